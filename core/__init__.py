# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiosity method on NumPy arrays; nothing here knows Blender.

One street, one direction: polygons (`scene`, or `scene_text` from the thesis's file) are cut into patches (`meshing`),
the light between the patches is described (`visibility`, `form_factors`, `transport`), solved for (`gathering`,
`shooting`), and brought to the corners of the mesh (`shading`). `bake` walks the whole street.
Lengths are metres, radiosity B and emission E radiant exitance [W/m^2], reflectance rho and form factors F plain ratios;
a colour is the radiance L = B / pi.
"""
