"""temp."""

import sys

sys.path.insert(0, "/work/w-space-sim/tests")
import numpy as np
from inhand.control.phases import Grasp


def planned_in_space(hand, spec, paths, gravity, starts, *, bench):
    from test_spatial_engine import CONTACTS, NORMALS, fingers_at
    from inhand.hands.spatial.kinematics import inverse
    from inhand.rotations import placed

    def at(off):
        out = []
        for i, f in enumerate(hand.fingers):
            goal = placed(starts, np.tile(CONTACTS[i] + (f.tip_radius + off) * NORMALS[i], (len(starts), 1)))
            q, m = inverse(f, goal, fingers_at(0.0)[hand.slices[i]][None])
            out.append(q[:, 0])
        return np.concatenate(out, -1)

    return Grasp(at(0.008), at(-0.002), way=np.full(len(starts), 0.02))
