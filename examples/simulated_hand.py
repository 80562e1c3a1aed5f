"""A simulated hand behind a socket, for real_hand.py: what `field` draws for it, its encoders, camera and delays."""

import json
import socket

import numpy as np

import inhand
from inhand.control.between import Between
from inhand.control.seen import SENSED
from inhand.sim.disturbance import FIELD
from inhand.sim.drawn import draw, truths
from inhand.sim.engines import make_simulator

ADDRESS = ("127.0.0.1", 5077)
JOINTS = (1.4, -1.6, -1.4, 1.6)  # where it is before anybody commands it [rad]
JITTER = (0.05, 0.9, 0.05)  # how often a command finds no time gone since the last, one decision of 20 ms, or two


def serve(listener, hand, thing, level=FIELD, seed=0):
    """Serve one client: a line [targets] commands and lets time go on, an empty list asks what is sensed."""
    world, rng = draw(level, (seed,), hand.n_joints), np.random.default_rng(seed)
    simulator = make_simulator("planar", *truths([world], hand, [thing], None), 1)
    state = simulator.reset(hand.start_pose[None] + world.drawn.start, np.array([JOINTS]))
    between = Between([world], state, simulator.timestep, 5)
    with listener.accept()[0] as line, line.makefile("rw") as lines:
        for targets in map(json.loads, lines):
            for _ in range(rng.choice(3, p=JITTER) if targets else 0):
                state = simulator.step(between.send(simulator, np.array([targets])), 5)
                between.take(state)
            if not targets:
                seen = between.seen(SENSED)
                frame = [seen.frame_time[0], *seen.frame_pose[0]]  # the last, also where it was told before
                print(json.dumps([seen.time[0], seen.joint_angles[0].tolist(), [frame]]), file=lines, flush=True)
    return state


if __name__ == "__main__":
    with socket.create_server(ADDRESS) as listener:
        serve(listener, inhand.hand("2v2_50.50_50.50_1.1_53"), inhand.object("cube_39"))
