/*
 * A flight computer in the loop: the exported flight software in a program of its own, which
 * answers measured states by UDP. The plant, the mission and the recorder fly on the ROS 2 graph.
 *
 *     flight_computer PORT
 *
 * It listens on 127.0.0.1 and runs until it is stopped. Each request and each answer is one
 * datagram of the structs below; space_robot_control/flight_code/remote.py has the other side.
 */
#define _POSIX_C_SOURCE 200112L

#include "space_robot_flight.h"

#include <arpa/inet.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

/* Kinds of requests. */
enum { BEGIN, JUDGE, ANSWER, USE, STAND_DOWN };

typedef struct {
    int64_t kind;
    int64_t law; /* of USE */
    space_robot_measurement measurement;
    space_robot_reference reference;
} request;

typedef struct {
    int64_t kind; /* of the request */
    int64_t tick;
    int64_t result;
    space_robot_command command;
    space_robot_condition condition;
    space_robot_telemetry telemetry;
} answer;

static volatile sig_atomic_t is_stopped = 0;

static void stop(int number)
{
    (void)number;
    is_stopped = 1;
}

static void serve(space_robot_state *state, const request *asked, answer *given)
{
    const int64_t tick = asked->measurement.tick;
    given->kind = asked->kind;
    given->tick = tick;
    given->result = 0;
    switch (asked->kind) {
    case BEGIN:
        space_robot_init(state);
        break;
    case JUDGE:
        given->result = space_robot_judge(state, tick);
        break;
    case ANSWER:
        given->result =
            space_robot_answer(state, &asked->measurement, &asked->reference, &given->command);
        break;
    case USE:
        space_robot_choose_law(state, (int)asked->law);
        break;
    case STAND_DOWN:
        space_robot_stand_down(state, tick, &given->command);
        break;
    default:
        given->result = -1;
        break;
    }
    space_robot_get_condition(state, &given->condition);
    space_robot_get_telemetry(state, &given->telemetry);
}

static int listen_on(uint16_t port)
{
    const struct timeval second = {.tv_sec = 1}; /* a signal may come just before the wait */
    struct sockaddr_in address = {0};
    const int udp = socket(AF_INET, SOCK_DGRAM, 0);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* no packet leaves the machine */
    address.sin_port = htons(port);
    if (udp < 0 || bind(udp, (const struct sockaddr *)&address, sizeof(address)) != 0) {
        perror("flight_computer");
        exit(2);
    }
    (void)setsockopt(udp, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof(second));
    return udp;
}

int main(int count, char **arguments)
{
    static space_robot_state state;
    static request asked;
    static answer given;
    const struct sigaction stopping = {.sa_handler = stop};
    const long port = count == 2 ? strtol(arguments[1], NULL, 10) : 0;
    int64_t answered = 0;
    if (port < 1 || port > 65535) {
        fprintf(stderr, "flight_computer PORT (1 to 65535)\n");
        return 2;
    }
    const int udp = listen_on((uint16_t)port);
    (void)sigaction(SIGINT, &stopping, NULL);
    (void)sigaction(SIGTERM, &stopping, NULL);
    space_robot_init(&state);
    printf("flight software of %d axes listens on 127.0.0.1:%ld\n", SPACE_ROBOT_AXES, port);
    (void)fflush(stdout);
    while (!is_stopped) {
        struct sockaddr_in peer;
        socklen_t length = sizeof(peer);
        const ssize_t size =
            recvfrom(udp, &asked, sizeof(asked), 0, (struct sockaddr *)&peer, &length);
        if (size != (ssize_t)sizeof(asked)) { /* none came, or not for this software */
            given.kind = -1;
            if (size > 0) {
                (void)sendto(udp, &given, sizeof(given.kind), 0, (struct sockaddr *)&peer, length);
            }
            continue;
        }
        serve(&state, &asked, &given);
        answered += asked.kind == ANSWER;
        (void)sendto(udp, &given, sizeof(given), 0, (struct sockaddr *)&peer, length);
    }
    printf("%" PRId64 " states answered\n", answered);
    (void)close(udp);
    return 0;
}
