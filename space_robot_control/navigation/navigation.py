"""Estimation of the state from measurements, tick by tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import direction_norm
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, whole
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import State

from .attitude_filter import (
    LONGEST_DELAY,
    NOT_STARTED,
    AttitudeFilter,
    drift,
    observe_tracker,
    propagate,
    start,
)
from .rate_filters import (
    JointFilter,
    LowPass,
    begin_joints,
    begin_low_pass,
    filter_joints,
    low_pass_weight,
    pass_low,
    tune,
)
from .settings import NavigationFilterSettings

Array = NDArray[np.float64]

LONGEST_BRIDGE = 20
"""Ticks from one state to the next over which the rates are interpolated; after a longer gap the
attitude begins anew."""


class Navigation(Record):
    """Filters, and the estimated state."""

    is_filtered: float = shaped(lambda n: (), uniform=True)
    """0: the laws see the measured state itself."""
    is_active: float = shaped(lambda n: (), "1 from the first state on")
    tick: float = shaped(lambda n: (), "Tick of the last state")
    attitude: AttitudeFilter = nested(AttitudeFilter)
    low_pass: LowPass = nested(LowPass)
    joints: JointFilter = nested(JointFilter)
    gyro: Array = shaped(lambda n: (3,), "Last sample, rad/s")
    between: Array = shaped(lambda n: (3,), "Scratch: a sample between two, or a rate; rad/s")
    estimate: State = nested(State)
    """What the laws see. Its torque lags as its rates do: so it is the one that belongs to them."""

    @classmethod
    def build(cls, n: int, settings: NavigationFilterSettings, period: float) -> Navigation:
        """Read the numbers of the settings, all of them given, for a robot of ``n`` joints."""
        navigation = cls.allocate(n)
        delay = round(settings.tracker_delay / period)
        if delay > LONGEST_DELAY:
            raise InputError(
                f"navigation_filter.tracker_delay must be at most {LONGEST_DELAY} ticks, "
                f"{LONGEST_DELAY * period:g} s, got {settings.tracker_delay:g} s"
            )
        boresight = np.array(settings.tracker_boresight)
        length = direction_norm(boresight, "navigation_filter.tracker_boresight")
        # covariance about the boresight b: across (E - b b^T) + about b b^T
        along = np.outer(boresight, boresight) / (length * length)
        across = settings.tracker_across * settings.tracker_across
        about = settings.tracker_about * settings.tracker_about
        assign(navigation, is_filtered=1.0)
        assign(
            navigation.attitude,
            noise=across * (np.eye(3) - along) + about * along,
            angle_walk=settings.gyro_angle_walk * settings.gyro_angle_walk,
            rate_walk=settings.gyro_rate_walk * settings.gyro_rate_walk,
            initial_bias_variance=settings.gyro_bias * settings.gyro_bias,
            gate=settings.gate * settings.gate,
            delay=delay,
        )
        assign(navigation.low_pass, weight=low_pass_weight(settings.rate_filter_hz, period))
        tune(
            navigation.joints,
            settings.joint_bandwidth_hz,
            settings.joint_angle_noise,
            settings.joint_rate_noise,
            period,
        )
        return navigation


@kernel
def navigate(navigation: Navigation, tick: int, measured: State, period: float) -> None:
    """Estimate the state at ``tick`` from ``measured`` into ``navigation.estimate``.

    The caller has checked that the measured state is usable (`status_of`). Over states
    that were lost (up to `LONGEST_BRIDGE`) the rates are interpolated; after more of them the
    attitude begins anew, and after a jump back in time everything does.
    """
    attitude, estimate = navigation.attitude, navigation.estimate
    elapsed = tick - whole(navigation.tick)
    if uniform(navigation.is_active) == 0.0 or elapsed < 1:
        attitude.stage = NOT_STARTED
        _begin(navigation, tick, measured, period)
    elif elapsed > LONGEST_BRIDGE:
        drift(attitude, elapsed * period)
        _begin(navigation, tick, measured, period)
    else:
        _go_on(navigation, tick, elapsed, measured, period)
    navigation.tick = tick
    navigation.gyro[:] = measured.omega_base
    estimate.base_position[:] = measured.base_position
    estimate.base_velocity[:] = measured.base_velocity
    estimate.quaternion[:] = attitude.present
    estimate.omega_base[:] = navigation.low_pass.rate
    estimate.joint_positions[:] = navigation.joints.angle
    estimate.joint_velocities[:] = navigation.joints.rate
    estimate.applied_torque[:3] = navigation.low_pass.torque
    estimate.applied_torque[3:] = navigation.joints.torque


@kernel
def _begin(navigation: Navigation, tick: int, measured: State, period: float) -> None:
    navigation.is_active = 1.0
    start(navigation.attitude, tick, measured.quaternion, measured.omega_base, period)
    _unbiased(navigation, measured.omega_base)
    begin_low_pass(navigation.low_pass, navigation.between, measured.applied_torque)
    begin_joints(
        navigation.joints,
        measured.joint_positions,
        measured.joint_velocities,
        measured.applied_torque[3:],
    )


@kernel
def _go_on(navigation: Navigation, tick: int, elapsed: int, measured: State, period: float) -> None:
    attitude, between, last = navigation.attitude, navigation.between, tick - elapsed
    for step in range(1, elapsed + 1):
        _interpolate(navigation, measured.omega_base, step / elapsed)
        propagate(attitude, last + step, between, period)
    observe_tracker(attitude, tick, measured.quaternion, elapsed == 1, period)
    # once more, since the tracker may have changed the bias
    for step in range(1, elapsed + 1):
        _interpolate(navigation, measured.omega_base, step / elapsed)
        _unbiased(navigation, between)
        pass_low(navigation.low_pass, between, measured.applied_torque)
    filter_joints(
        navigation.joints,
        measured.joint_positions,
        measured.joint_velocities,
        measured.applied_torque[3:],
        elapsed * period,
    )


@kernel
def _interpolate(navigation: Navigation, gyro: Array, share: float) -> None:
    for i in range(3):
        last = navigation.gyro[i]
        navigation.between[i] = gyro[i] if share == 1.0 else last + share * (gyro[i] - last)


@kernel
def _unbiased(navigation: Navigation, gyro: Array) -> None:
    for i in range(3):
        navigation.between[i] = gyro[i] - navigation.attitude.bias[i]
