# SPDX-License-Identifier: GPL-3.0-or-later
"""What blocks light: surfaces in as few triangles as they can be, and streams of segments through a tree of them.

`surfaces` tells what blocks, `joining` (with `outlines` and `trapezoids`) makes one polygon of a flat stretch of faces,
`streams` and `stragglers` ask a `stream_tree`, which is grown as a `box_tree`. `core.visibility` chooses who answers.
"""
