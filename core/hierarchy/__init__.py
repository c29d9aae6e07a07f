# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchical method: transport through a hierarchy of sources, what users run.

One street inside the street: patches -> `elements` -> `sources` (clusters in a `tree`) -> `links` from `receivers`,
weighed in an `exchange` by `kernels` and `rays` -> `rows` -> `transport` -> bounces (`solve`) -> the final gather at
`corners`. `quality` says how finely.
"""
