#!/usr/bin/env python3
"""Reads a map store; written from docs/store-format.md alone.

    python read_store.py MAP.dmpmap [OUT.json]

The JSON: {"provenance", "own_from_world", "voxel_units", "tiles": [{"x", "y", "origin_in_world_m", "z_range_m", "min_third_lowest",
"max_third_highest", "own", "surfels": [[centre x, y, z, normal x, y, z, third lowest, third highest], ...]}, ...]},
tiles by rows, centres in the tile's coordinates, the first `own` surfels the tile's own.
"""

import json
import struct
import sys
import zlib

import numpy as np
import zstandard


def checked(data, crc, what):
    if zlib.crc32(data) != crc:
        raise ValueError(f"{what}: checksum {zlib.crc32(data):08x}, {crc:08x} was written")
    return data


class Columns:
    """The columns of a blob, one after the other."""

    def __init__(self, data):
        self.data, self.at = np.frombuffer(data, np.uint8), 0

    def next(self, rows, width):
        planes = self.data[self.at:self.at + rows * width].reshape(width, rows)
        self.at += rows * width
        return sum(planes[k].astype(np.int64) << 8 * k for k in range(width))


def signed(values, bits):
    return (values + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def unzigzag(values):
    return np.where(values % 2 == 0, values // 2, -(values // 2) - 1)


def surfels_of(data, cells, surfels, voxel_units, across_steps, base_voxel_z):
    columns = Columns(data)
    z = signed(np.cumsum(columns.next(cells, 4)), 32)
    y, x = (signed(np.cumsum(columns.next(cells, 2)), 16) for _ in range(2))
    voxels, p, q = columns.next(cells, 1), columns.next(cells, 3), columns.next(cells, 3)
    axis, p, q = p >> 20, ((p & 0xfffff) - 2**18) / 2**18, (q - 2**18) / 2**18
    a, b = columns.next(surfels, 2), columns.next(surfels, 2)
    depth = columns.next(surfels, 3)
    lowest = signed(np.cumsum(unzigzag(columns.next(surfels, 4))), 32)
    highest = signed(lowest + unzigzag(columns.next(surfels, 4)), 32)
    if columns.at != len(data):
        raise ValueError(f"{len(data)} bytes are not {surfels} surfels in {cells} cells")
    rows = []
    for cell in range(cells):
        length = np.sqrt(1.0 + p[cell] * p[cell] + q[cell] * q[cell])
        along, others = axis[cell], [k for k in range(3) if k != axis[cell]]
        normal = np.zeros(3)
        normal[along], normal[others[0]], normal[others[1]] = 1.0 / length, p[cell] / length, q[cell] / length
        for bit in range(8):
            if not voxels[cell] >> bit & 1:
                continue
            row = len(rows)
            voxel = [2 * x[cell] + (bit & 1), 2 * y[cell] + (bit >> 1 & 1), 2 * z[cell] + (bit >> 2) - base_voxel_z]
            steps = np.array(voxel, np.int64) * voxel_units * 32
            steps[along] += depth[row]
            steps[others[0]] += a[row] * 32 // across_steps
            steps[others[1]] += b[row] * 32 // across_steps
            numbers = np.concatenate([steps / 2**18, normal]).astype(np.float32)
            rows.append([float(number) for number in numbers] + [int(lowest[row]), int(highest[row])])
    if len(rows) != surfels:
        raise ValueError(f"the cells have {len(rows)} of {surfels} surfels")
    return rows


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    magic, version, form, voxel_units, tile_voxels, across_steps = struct.unpack_from("<8s5I", data)
    if (magic, version, form) != (b"DMPSTORE", 4, 1):
        raise ValueError(f"{path}: {magic} of version {version} and form {form}, not form 1 of version 4")
    checked(data[:60], struct.unpack_from("<I", data, 60)[0], "header")
    footer = data[-40:]
    start, length, crc, count, footer_crc, end = struct.unpack("<QQIQI8s", footer)
    if end != b"DMPSTEND":
        raise ValueError(f"{path}: cut short")
    checked(footer[:28], footer_crc, "footer")
    directory = checked(data[start:start + length], crc, "directory")
    text = struct.unpack_from("<I", directory)[0]
    own_from_world = struct.unpack_from("<7d", directory, 4 + text)
    tiles = []
    for k in range(count):
        entry = struct.unpack_from("<5i2d" + 3 * "QIIII", directory, 60 + text + 108 * k)
        y, x, base_voxel_z, lowest, highest, low, high = entry[:7]
        surfels, left_out, blobs = [], [], [entry[7:12], entry[12:17], entry[17:22]]
        for found, (offset, size, rows, cells, crc) in zip([surfels, surfels, left_out], blobs):
            if rows:
                blob = checked(data[offset:offset + size], crc, f"tile ({x}, {y})")
                blob = zstandard.ZstdDecompressor().decompress(blob, max_output_size=15 * (cells + rows))
                found += surfels_of(blob, cells, rows, voxel_units, across_steps, base_voxel_z)
        origin = [v * voxel_units / 2**13 for v in (x * tile_voxels, y * tile_voxels, base_voxel_z)]
        tiles.append({"x": x, "y": y, "origin_in_world_m": origin, "z_range_m": [low, high],
                      "min_third_lowest": lowest, "max_third_highest": highest,
                      "own": blobs[0][2], "surfels": surfels, "left_out": left_out})
    return {"provenance": directory[4:4 + text].decode(), "own_from_world": own_from_world,
            "voxel_units": voxel_units, "tiles": tiles}


if __name__ == "__main__":
    text = json.dumps(read(sys.argv[1])).replace("{\"x\"", "\n{\"x\"").replace("], [", "],\n[") + "\n"
    if len(sys.argv) > 2:
        with open(sys.argv[2], "w", encoding="utf-8") as out:
            out.write(text)
    else:
        sys.stdout.write(text)
