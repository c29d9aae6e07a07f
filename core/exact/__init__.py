# SPDX-License-Identifier: GPL-3.0-or-later
"""Form factors between whole polygons, exact to a tolerance, with partial visibility (T3): `core.form_factor_matrix`.

`view_factors` checks and distributes; `contour_integral` is the exchange of polygons that see each other whole,
`visible_exchange` that of the others, by `hidden_sources` over `receiver_cells`.
"""
