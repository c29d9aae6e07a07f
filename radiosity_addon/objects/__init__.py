# SPDX-License-Identifier: GPL-3.0-or-later
"""What a Blender scene consists of: which objects count, their evaluated meshes, their instances, what each may do."""
