"""Makes the meshes in this folder: a box of 2 m x 3 m x 4 m around (10, 20, 30), as trimesh writes it.

    pip install trimesh==4.* numpy
    python make.py
"""

import pathlib

import trimesh

folder = pathlib.Path(__file__).parent
box = trimesh.creation.box(extents=(2, 3, 4))
box.apply_translation((10, 20, 30))
(folder / "box_ascii.ply").write_bytes(trimesh.exchange.ply.export_ply(box, encoding="ascii"))
(folder / "box_binary.ply").write_bytes(trimesh.exchange.ply.export_ply(box, encoding="binary"))
(folder / "box.obj").write_text(trimesh.exchange.obj.export_obj(box, include_normals=True))
