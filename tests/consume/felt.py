# SPDX-License-Identifier: Apache-2.0
"""A program that knows the installed package alone: a ball is felt, recorded and replayed."""
import palpate
scene = palpate.Scene({
    'volume': {'ball': {'analytic': 'solid_sphere', 'radius_mm': 30}},
    'surface': {'skin': {'volume': 'ball'}},
    'effect': [{'type': 'surface', 'surface': 'skin'}],
})
trace = palpate.trace(scene, [[0, 0, 1e-3 * (35 - 0.1 * i)] for i in range(71)])
assert trace['felt'][-1] == 'skin' and trace.force_n[-1, 2] > 0.5, trace.force_n[-1]
trace.save('recording.h5', force=True)
assert len(palpate.replay('recording.h5')) == 71
print(palpate.__version__, palpate.__file__)
