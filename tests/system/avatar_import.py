# SPDX-License-Identifier: Apache-2.0
"""Imports an avatar into Blender, prints what arrived as one JSON line and renders it.

  blender --background --factory-startup --python avatar_import.py -- FILE.glb|FILE.vrm|FILE.fbx [OUT_DIR]

Pictures in OUT_DIR: front, left, back, right (from the avatar's view), face, jaw_open, raised_arm.
"""
import json
import math
import os
import sys

import bpy
import numpy
from mathutils import Vector

# Blender 3.4's importer still uses an alias that numpy 1.24, both as in Debian 12, has dropped.
if not hasattr(numpy, "bool"):
    numpy.bool = bool

PICTURE_SIZE = (480, 720)


def facts(mesh, armature):
    keys = mesh.data.shape_keys
    moved, farthest = {}, {}
    if keys:
        world = mesh.matrix_world
        basis = numpy.empty(3 * len(mesh.data.vertices))
        keys.key_blocks[0].data.foreach_get("co", basis)
        basis = basis.reshape(-1, 3)
        for block in keys.key_blocks[1:]:
            shape = numpy.empty(basis.size)
            block.data.foreach_get("co", shape)
            offsets = (shape.reshape(-1, 3) - basis) @ numpy.array(world.to_3x3()).T
            lengths = numpy.linalg.norm(offsets, axis=1)
            moved[block.name] = int((lengths > 1e-5).sum())
            most = int(lengths.argmax())
            farthest[block.name] = {"from": [float(x) for x in gltf_axes(world @ Vector(basis[most]))],
                                    "by": [float(x) for x in gltf_axes(Vector(offsets[most]))]}
    weights = [sum(g.weight for g in v.groups) for v in mesh.data.vertices]
    return {
        "vertices": len(mesh.data.vertices),
        "triangles": len(mesh.data.polygons),
        "uv_layers": len(mesh.data.uv_layers),
        "images": sum(1 for image in bpy.data.images if image.source == "FILE"),
        "bones": sorted(b.name for b in armature.data.bones),
        "heads_m": {b.name: [round(x, 5) for x in gltf_axes(armature.matrix_world @ b.head_local)]
                    for b in armature.data.bones},
        "armature_modifier": any(m.type == "ARMATURE" and m.object == armature for m in mesh.modifiers),
        "weight_sum_min": min(weights),
        "weight_sum_max": max(weights),
        "influences_max": max(len(v.groups) for v in mesh.data.vertices),
        "shape_keys": list(moved),
        "moved_by_shape_key": moved,
        "farthest_by_shape_key": farthest,
    }


def gltf_axes(v):
    """Blender is Z up and the importer turns the scene; back to Y up, facing +Z."""
    return (v.x, v.z, -v.y)


def camera_at(position, target, width_m):
    camera = bpy.data.objects["look"]
    camera.location = position
    camera.rotation_euler = (Vector(target) - Vector(position)).to_track_quat("-Z", "Y").to_euler()
    camera.data.ortho_scale = width_m


def render(path):
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def prepare_scene():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("look", bpy.data.cameras.new("look"))
    camera.data.type = "ORTHO"
    scene.collection.objects.link(camera)
    scene.camera = camera
    # The workbench engine needs no graphics card to show a texture, only software OpenGL; Cycles needs neither.
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 4
    scene.cycles.use_denoising = False  # Debian builds without it
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("light")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.render.resolution_x, scene.render.resolution_y = PICTURE_SIZE


def render_all(mesh, armature, folder):
    os.makedirs(folder, exist_ok=True)
    prepare_scene()
    corners = [mesh.matrix_world @ Vector(c) for c in mesh.bound_box]
    height = max(c.z for c in corners)
    middle = Vector((0, 0, height / 2))
    for name, yaw in (("front", 0), ("left", 90), ("back", 180), ("right", 270)):
        angle = math.radians(yaw)
        camera_at(middle + 4 * Vector((math.sin(angle), -math.cos(angle), 0)), middle, 1.15 * height)
        render(os.path.join(folder, name + ".png"))
    head = armature.matrix_world @ armature.data.bones["head"].head_local
    face = head + Vector((0, 0, 0.06))
    camera_at(face + Vector((0.2, -1, 0.05)), face, 0.36)
    render(os.path.join(folder, "face.png"))
    keys = mesh.data.shape_keys
    if keys and "jawOpen" in keys.key_blocks:
        keys.key_blocks["jawOpen"].value = 1
        render(os.path.join(folder, "jaw_open.png"))
        keys.key_blocks["jawOpen"].value = 0
    arm = armature.pose.bones.get("leftUpperArm")
    if arm:
        world = arm.bone.matrix_local.to_3x3()
        raised = Vector((0.15, 0, 1)).normalized()  # armature axes are the world's: Z up here
        tip = armature.data.bones["leftLowerArm"].head_local - arm.bone.head_local
        turn = tip.rotation_difference(raised)
        arm.rotation_mode = "QUATERNION"
        arm.rotation_quaternion = (world.inverted() @ turn.to_matrix() @ world).to_quaternion()
        camera_at(middle + Vector((0, -4, 0.2)), middle + Vector((0, 0, 0.2)), 1.4 * height)
        render(os.path.join(folder, "raised_arm.png"))


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if not arguments:
        sys.exit("usage: blender --background --factory-startup --python avatar_import.py -- FILE.glb|FILE.vrm|FILE.fbx [OUT_DIR]")
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    if arguments[0].endswith(".fbx"):
        bpy.ops.import_scene.fbx(filepath=arguments[0])
    else:
        bpy.ops.import_scene.gltf(filepath=arguments[0])
    mesh = next(o for o in bpy.data.objects if o.type == "MESH" and o.vertex_groups)
    armature = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    print(json.dumps(facts(mesh, armature)))
    if len(arguments) > 1:
        render_all(mesh, armature, arguments[1])


main()
