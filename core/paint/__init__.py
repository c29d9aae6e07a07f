# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that vary inside their faces: what textures and color attributes make of reflectance and emission."""
