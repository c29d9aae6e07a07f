# SPDX-License-Identifier: GPL-3.0-or-later
"""What the thesis's matrix of form factors is computed from, block by block or column by column (T8, T13).

`exchange` holds points, groups and blockers; `blocks` the symmetric A_i F_ij; `visible_share` how much of each other
two groups see, with `shafts` and `shadows`; `hemicube_rows` are the same by hemicubes. `matrix` fills all of the matrix
with these, for gathering, `columns` one column at a time, for shooting.
"""
