"""Drive a hand: put encoders, camera and servos into `read` and `command`; here simulated_hand.py behind a socket."""

import json
import socket
import sys

import inhand

ADDRESS = ("127.0.0.1", 5077)


def functions(lines):
    """Return the two functions by which a hand at the other end of a socket is driven."""

    def read():
        """Ask for what is sensed: time and joint angles [rad], and frames as (time, (x, y, theta)) [m, m, rad]."""
        print("[]", file=lines, flush=True)
        time, joints, frames = json.loads(lines.readline())
        return inhand.Reading(time, joints, [inhand.Frame(taken, pose) for taken, *pose in frames])

    def command(targets):
        """Tell the servos where to go [rad]."""
        print(json.dumps(targets.tolist()), file=lines, flush=True)

    return read, command


def main(address=ADDRESS, **settings):
    """Carry the cube away from the palm and return what that left."""
    with socket.create_connection(address, timeout=60) as line, line.makefile("rw") as lines:
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # else small lines wait for one another
        return inhand.drive(*functions(lines), direction="Out", **settings)


if __name__ == "__main__":
    driven = main()
    print(driven.outcome, driven.message, f"{1e3 * driven.moved[1]:.0f} mm")
    sys.exit(driven.outcome != "reached")
