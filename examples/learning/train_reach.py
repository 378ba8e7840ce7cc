"""Learning: a policy that moves the arm and holds the base, by PPO, then flown as a law.

Proximal policy optimisation (Schulman et al., arXiv:1707.06347) in one file, on PyTorch. The
environments step eight at a time on a processor, or by the ten thousands on an NVIDIA device, whose
arrays PyTorch has without a copy; a flight has the same bits in both.

    python examples/learning/train_reach.py --device gpu                     # writes policy.npz
    python examples/learning/train_reach.py --envs 256 --iterations 150      # on two cores
    python examples/learning/train_reach.py --fly policy.npz                 # the policy as a law

On the ROS graph it flies as any other law does, ``POLICY=policy.npz`` in the environment:

    space-robot fly --controller examples/learning/train_reach.py:PolicyLaw --duration 2
"""

from __future__ import annotations

import argparse
import os
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import space_robot as sr
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis
from space_robot_model.dynamics.attitude import attitude_jacobian_inverse

Array = NDArray[np.float64]

TICKS = 20
"""Of a step: the policy acts at 100 Hz, and its torque is held in between."""
SCALE = np.array([1500.0] * 3 + [300.0, 850.0, 750.0, 20.0, 20.0, 5.0])
"""Torque of an action of 1, N m: base x, y, z, then the joints."""
RATES = np.array([0.2] * 3 + [1.0] * 6)
"""Typical errors, rad, then the same for rates, rad/s: what the policy sees is divided by them."""
SEEN = np.concatenate([0.05 * RATES, RATES])
TASK: dict[str, Any] = {"duration": 2.0, "ticks_per_step": TICKS, "torque_scale": SCALE}
GAMMA, LAMBDA, CLIP, EPOCHS, HORIZON = 0.98, 0.95, 0.2, 4, 50
RATE, ENTROPY, LAYER, WORST = 1e-3, 0.0, 128, 20.0


def train(device: str, count: int, iterations: int, seed: int) -> tuple[Any, list[float]]:
    """Train a policy; return its network, and the mean reward a second of each iteration."""
    import torch  # type: ignore[import-not-found,unused-ignore]
    from torch import nn

    torch.manual_seed(seed)
    place = "cuda" if device == "gpu" else "cpu"
    envs = sr.make_vec("reach", count, device=device, **TASK)
    seen, axes = torch.tensor(SEEN, device=place, dtype=torch.float32), len(SCALE)

    def network(outputs: int, gain: float) -> nn.Sequential:
        layers = [nn.Linear(2 * axes, LAYER), nn.Tanh(), nn.Linear(LAYER, LAYER), nn.Tanh()]
        last = nn.Linear(LAYER, outputs)
        for layer in (layers[0], layers[2]):
            nn.init.orthogonal_(layer.weight, 2.0**0.5)
        nn.init.orthogonal_(last.weight, gain)
        return nn.Sequential(*layers, last).to(place)

    def tensor(array: Any) -> torch.Tensor:
        is_numpy = isinstance(array, np.ndarray)
        there = torch.from_numpy(array) if is_numpy else torch.from_dlpack(array)
        return there.to(place, torch.float32, copy=True)

    def step(action: torch.Tensor) -> list[torch.Tensor]:
        torques = action.clamp(-1.0, 1.0).double().contiguous()
        results = envs.step(torques if device == "gpu" else torques.numpy())
        observation, reward, failed, truncated = map(tensor, results[:4])
        return [(observation / seen).clamp(-5.0, 5.0), reward, failed, truncated]

    actor, critic = network(axes, 0.01), network(1, 1.0)
    spread = nn.Parameter(torch.full((axes,), -1.2, device=place))
    parameters = [*actor.parameters(), *critic.parameters(), spread]
    optimiser = torch.optim.Adam(parameters, lr=RATE, eps=1e-5)
    per_step = TICKS * envs.task.period
    state = (tensor(envs.reset(seed=seed)[0]) / seen).clamp(-5.0, 5.0)
    over, history = torch.zeros(count, device=place), []
    begun = time.monotonic()
    for iteration in range(iterations):
        optimiser.param_groups[0]["lr"] = RATE * (1.0 - iteration / iterations)
        steps: dict[str, list[torch.Tensor]] = {name: [] for name in NAMES}
        with torch.no_grad():
            for _ in range(HORIZON):
                policy = torch.distributions.Normal(actor(state), spread.exp())
                action = policy.sample()
                after, reward, failed, truncated = step(action)
                values = critic(state).squeeze(1)
                # a failure costs all that is left at once, which no critic can learn; squares of
                # small errors cost nothing, so their absolute values do
                sharp = after[:, :axes].abs().mean(1)
                cost = (reward / per_step - sharp).clamp(min=-WORST)
                record = state, action, policy.log_prob(action).sum(1), cost, values
                # a step after the end of an episode begins the next one, whatever the action
                flags = failed, truncated, 1.0 - over
                for name, value in zip(NAMES, (*record, *flags), strict=True):
                    steps[name].append(value)
                state, over = after, torch.maximum(failed, truncated)
            data = {name: torch.stack(value) for name, value in steps.items()}
            last = critic(state).squeeze(1)
            advantage, total = torch.zeros_like(data["reward"]), torch.zeros(count, device=place)
            for k in reversed(range(HORIZON)):
                goes_on = 1.0 - torch.maximum(data["failed"][k], data["truncated"][k])
                # what comes after a time limit is worth what the critic says of its last state
                delta = 0.02 * data["reward"][k] - data["value"][k]
                delta = delta + GAMMA * (1.0 - data["failed"][k]) * last
                advantage[k] = total = delta + GAMMA * LAMBDA * goes_on * total
                last = data["value"][k]
            target = advantage + data["value"]
        valid = data["is_valid"].flatten() > 0.0
        flat = {name: value.flatten(0, 1)[valid] for name, value in data.items()}
        gains, targets = advantage.flatten()[valid], target.flatten()[valid]
        for _ in range(EPOCHS):
            for rows in torch.randperm(len(gains), device=place).chunk(8):
                policy = torch.distributions.Normal(actor(flat["state"][rows]), spread.exp())
                chance = policy.log_prob(flat["action"][rows]).sum(1) - flat["chance"][rows]
                gain = (gains[rows] - gains[rows].mean()) / (gains[rows].std() + 1e-8)
                clipped = chance.exp().clamp(1.0 - CLIP, 1.0 + CLIP)
                loss = -torch.min(chance.exp() * gain, clipped * gain).mean()
                error = critic(flat["state"][rows]).squeeze(1) - targets[rows]
                loss = loss + 0.5 * error.square().mean() - ENTROPY * policy.entropy().mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimiser.step()
        history.append(float(flat["reward"].mean()))
        if iteration % 10 == 9:
            print(f"iteration {iteration + 1}: reward {history[-1]:.4f} a second,", end=" ")
            print(f"{time.monotonic() - begun:.0f} s", flush=True)
    return actor, history


NAMES = ("state", "action", "chance", "reward", "value", "failed", "truncated", "is_valid")


def save(actor: Any, file: Path) -> None:
    """Write the weights of a policy."""
    layers = [layer for layer in actor.cpu() if hasattr(layer, "weight")]
    weights = {f"w{k}": layer.weight.detach().numpy() for k, layer in enumerate(layers)}
    biases = {f"b{k}": layer.bias.detach().numpy() for k, layer in enumerate(layers)}
    np.savez(file, **weights, **biases)


class Gains(LawGains):
    """Of a policy, that has its weights in a file."""

    limit = per_axis("largest action", "1")


class PolicyLaw(ControlLaw):
    """A policy as a law: torques that are held over `TICKS` ticks."""

    name = "policy"
    gains_type = Gains

    def __init__(self, *arguments: Any) -> None:
        """Read the weights of the file that the environment variable POLICY names."""
        super().__init__(*arguments)
        content = np.load(os.environ.get("POLICY", "policy.npz"))
        self._layers = [(content[f"w{k}"], content[f"b{k}"]) for k in range(len(content) // 2)]
        self._torque = np.zeros(len(SCALE))

    def force(self, signals: Signals) -> Array:
        """Return the generalised force F_S (m,), N m: ``J0^-T tau`` for the base."""
        if int(signals.tick) % TICKS == 0:
            rates = np.concatenate([signals.omega_base, signals.joint_velocities])
            seen = np.concatenate([signals.error, rates]) / SEEN
            layer = np.clip(seen, -5.0, 5.0).astype(np.float32)
            for weights, biases in self._layers[:-1]:
                layer = np.tanh(weights @ layer + biases)
            weights, biases = self._layers[-1]
            self._torque = SCALE * np.clip(weights @ layer + biases, -1.0, 1.0)
        inverse, force = np.zeros((3, 3)), self._torque.copy()
        attitude_jacobian_inverse(signals.attitude_error, inverse)
        force[:3] = inverse.T @ self._torque[:3]
        return force


def fly(file: Path) -> None:
    """Fly a policy as a law from 0.3 rad beside the posture that it is to reach."""
    os.environ["POLICY"] = str(file)
    joints = np.array([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
    offset = np.degrees([0.3, -0.3, 0.2, 0.3, -0.3, 0.3])
    scenario = sr.Scenario(
        controller=PolicyLaw,
        gains={"limit": [1.0] * len(SCALE)},
        mission={"start": {"joints_deg": joints.tolist()}, "segments": [{"hold": 2.0}]},
        parameters={"plant": {"initial_joints_deg": (joints + offset).tolist()}},
        duration=2.0,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it is told that the start is beside the mission's
        log = scenario.fly().log
    error = np.degrees(log.joint_positions[-1] - log.reference_joints[-1, 0])
    attitude = 2.0 * np.degrees(np.linalg.norm(log.quaternion[:, 1:], axis=1))
    print(f"joints at the end at most {np.abs(error).max():.2f} deg off,", end=" ")
    print(f"base {attitude[-1]:.3f} deg, at most {attitude.max():.3f} deg")


def main() -> None:
    """Train or fly."""
    parser = argparse.ArgumentParser(description="A policy for the task reach, by PPO.")
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu")
    parser.add_argument("--envs", type=int, default=8192)
    parser.add_argument("--iterations", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("policy.npz"))
    parser.add_argument("--fly", type=Path, metavar="FILE", help="fly a policy instead")
    asked = parser.parse_args()
    if asked.fly:
        fly(asked.fly)
        return
    actor, history = train(asked.device, asked.envs, asked.iterations, asked.seed)
    save(actor, asked.out)
    print(f"reward a second from {history[0]:.4f} to {history[-1]:.4f}: {asked.out}")
    fly(asked.out)


if __name__ == "__main__":
    main()
