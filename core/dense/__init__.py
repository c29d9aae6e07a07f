# SPDX-License-Identifier: GPL-3.0-or-later
"""What the thesis's matrix of form factors is computed from, block by block or column by column (T8, T13).

`exchange` holds points, groups and blockers; `blocks` the symmetric A_i F_ij; `visible_share` how much of each other
two groups see, with `shafts` and `shadows`; `columns` and `hemicube_rows` the same for shooting and by hemicubes.
"""
