"""Path-traces jobs of `strandcast-report pictures` with Blender's Cycles on the processors (Blender 3.4).

    blender -b --factory-startup -P cycles.py -- JOBS.json

JOBS.json is a list of jobs. Each names files beside it and says all that a picture needs, in SI units:

  strands, head   strands: uint32 points of each strand; then float32 x y z radius red green blue of each point.
                  head: float32 x y z of each vertex; then uint32 triangles. Numbers of both are in `counts`.
  camera          position, target, fov_y_rad, width, height
  suns            direction of travel, linear colour: a white matt face towards it then has the colour
  sky             light that a white matt face gets from above; it gets 0.35 of it from below
  hair, skin      roughness and tilt of the scales (rad); colour of the skin
  samples, seed, threads
  light           file to write: float32 red green blue alpha, linear, premultiplied, top row first
  cover           likewise: shares of hair (red) and skin (green)

It prints "CYCLES name processor_s" after each picture. Hair is the Principled Hair BSDF (Chiang et al. 2016), whose
absorption follows from colour; curves are ribbons that face the ray; pixels are boxes.
"""
import json
import math
import os
import sys
import time

import bpy
import numpy as np
from mathutils import Matrix, Vector

SCALE = 10.0  # units of Blender in a metre: rays start some 1e-5 units off a surface, a hair is 1e-4 m wide
BOUNCES = 32
MASK_SAMPLES = 32


def shader_nodes(block):
    block.use_nodes = True
    block.node_tree.nodes.clear()
    return block.node_tree.nodes, block.node_tree.links


def glow(name, color):
    material = bpy.data.materials.new(name)
    nodes, links = shader_nodes(material)
    emission = nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (*color, 1.0)
    links.new(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def hair_material(desc):
    material = bpy.data.materials.new("hair")
    nodes, links = shader_nodes(material)
    fibre = nodes.new("ShaderNodeBsdfHairPrincipled")
    fibre.parametrization = "COLOR"
    for name, value in {"Roughness": desc["roughness"], "Radial Roughness": desc["radial_roughness"], "Coat": 0.0,
                        "IOR": 1.55, "Offset": desc["tilt_rad"], "Random Roughness": 0.0,
                        "Random Color": 0.0}.items():
        fibre.inputs[name].default_value = value
    color = nodes.new("ShaderNodeAttribute")
    color.attribute_name = "color_of_hair"
    links.new(color.outputs["Color"], fibre.inputs["Color"])
    links.new(fibre.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def skin_material(color):
    material = bpy.data.materials.new("skin")
    nodes, links = shader_nodes(material)
    skin = nodes.new("ShaderNodeBsdfPrincipled")
    skin.inputs["Base Color"].default_value = (*color, 1.0)
    skin.inputs["Roughness"].default_value = 0.5
    skin.inputs["Specular"].default_value = 0.3
    links.new(skin.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def link(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(thing)
    return thing


def add_strands(folder, job, material):
    """Edges of a mesh become curves by nodes: Blender 3.4 cannot make curves from numbers."""
    strands, points = job["counts"]["strands"], job["counts"]["points"]
    raw = open(os.path.join(folder, job["strands"]), "rb").read()
    count = np.frombuffer(raw, "<u4", strands)
    table = np.frombuffer(raw, "<f4", points * 7, strands * 4).reshape(points, 7)
    lines = bpy.data.meshes.new("lines")
    lines.vertices.add(points)
    lines.vertices.foreach_set("co", np.ascontiguousarray(table[:, :3] * SCALE).ravel())
    begins = np.ones(points, bool)
    begins[np.cumsum(count) - 1] = False
    first = np.nonzero(begins)[0].astype(np.int32)
    lines.edges.add(len(first))
    lines.edges.foreach_set("vertices", np.column_stack([first, first + 1]).ravel())
    lines.attributes.new("radius", "FLOAT", "POINT").data.foreach_set(
        "value", np.ascontiguousarray(table[:, 3] * SCALE))
    rgba = np.ones((points, 4), np.float32)
    rgba[:, :3] = np.clip(table[:, 4:7], 1e-3, 0.99)
    lines.attributes.new("color_of_hair", "FLOAT_COLOR", "POINT").data.foreach_set("color", rgba.ravel())
    lines.update()
    source = link("lines", lines)
    source.hide_render = True

    group = bpy.data.node_groups.new("to curves", "GeometryNodeTree")
    group.outputs.new("NodeSocketGeometry", "Geometry")
    get = group.nodes.new("GeometryNodeObjectInfo")
    get.inputs[0].default_value = source
    convert = group.nodes.new("GeometryNodeMeshToCurve")
    paint = group.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(get.outputs["Geometry"], convert.inputs["Mesh"])
    group.links.new(convert.outputs["Curve"], paint.inputs["Geometry"])
    group.links.new(paint.outputs["Geometry"], end.inputs[0])
    hair = bpy.data.hair_curves.new("hair")
    hair.materials.append(material)
    link("hair", hair).modifiers.new("to curves", "NODES").node_group = group
    return paint


def add_head(folder, job, material):
    vertices, triangles = job["counts"]["head_vertices"], job["counts"]["head_triangles"]
    if triangles == 0:
        return None
    raw = open(os.path.join(folder, job["head"]), "rb").read()
    position = np.frombuffer(raw, "<f4", vertices * 3).reshape(-1, 3) * SCALE
    corner = np.frombuffer(raw, "<u4", triangles * 3, vertices * 12).reshape(-1, 3)
    mesh = bpy.data.meshes.new("head")
    mesh.from_pydata(position.tolist(), [], corner.tolist())
    mesh.polygons.foreach_set("use_smooth", [True] * triangles)
    mesh.materials.append(material)
    return link("head", mesh)


def frame_looking_from(back):
    """Axes of what looks along -back, as cameras and suns of Blender do, with +Y up."""
    z = Vector(back).normalized()
    x = Vector((0, 1, 0)).cross(z)
    x = x.normalized() if x.length > 1e-6 else Vector((1, 0, 0))
    return Matrix((x, z.cross(x), z)).transposed().to_4x4()


def add_suns(job):
    for sun in job["suns"]:
        strength = max(sun["color"])
        if strength <= 0:
            continue
        light = bpy.data.lights.new("sun", "SUN")
        light.energy = math.pi * strength
        light.color = [c / strength for c in sun["color"]]
        light.angle = math.radians(0.53)
        link("sun", light).matrix_world = frame_looking_from([-d for d in sun["direction"]])


def add_sky(sky):
    """Radiance a + b y: from below a face gets a - 2/3 b, from above a + 2/3 b."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    nodes, links = shader_nodes(world)
    background = nodes.new("ShaderNodeBackground")
    axes = nodes.new("ShaderNodeSeparateXYZ")
    ramp = nodes.new("ShaderNodeMath")
    ramp.operation = "MULTIPLY_ADD"
    ramp.inputs[1].default_value = sky * (1.0 - 0.35) * 0.75
    ramp.inputs[2].default_value = sky * (1.0 + 0.35) * 0.5
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], axes.inputs[0])
    links.new(axes.outputs["Y"], ramp.inputs[0])
    links.new(ramp.outputs[0], background.inputs["Strength"])
    links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs[0])


def add_camera(desc):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = desc["fov_y_rad"]
    camera.clip_start, camera.clip_end = 0.01 * SCALE, 50 * SCALE
    thing = link("camera", camera)
    position = Vector(desc["position"])
    thing.matrix_world = Matrix.Translation(position * SCALE) @ frame_looking_from(position - Vector(desc["target"]))
    bpy.context.scene.camera = thing


def set_up(job):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = job["camera"]["width"], job["camera"]["height"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.cycles_curves.shape = "RIBBONS"
    scene.cycles_curves.subdivisions = 1
    c = scene.cycles
    c.device, c.samples, c.seed = "CPU", job["samples"], job["seed"]
    c.use_adaptive_sampling = c.use_denoising = False
    c.max_bounces = c.glossy_bounces = c.transmission_bounces = BOUNCES
    c.diffuse_bounces, c.transparent_max_bounces = 4, 8
    c.sample_clamp_indirect = 0.0
    c.pixel_filter_type, c.filter_width = "BOX", 1.0


def render(path):
    scratch = path + ".exr"
    bpy.context.scene.render.filepath = scratch
    begin = time.process_time()
    bpy.ops.render.render(write_still=True)
    took = time.process_time() - begin
    image = bpy.data.images.load(scratch)
    image.colorspace_settings.name = "Linear"
    image.alpha_mode = "PREMUL"
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels.reshape(image.size[1], -1)[::-1].tofile(path)
    bpy.data.images.remove(image)
    os.remove(scratch)
    return took


def draw(folder, job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    set_up(job)
    paint = add_strands(folder, job, hair_material(job["hair"]))
    head = add_head(folder, job, skin_material(job["skin"]))
    add_suns(job)
    add_sky(job["sky"])
    add_camera(job["camera"])
    if "light" in job:
        took = render(os.path.join(folder, job["light"]))
        print("CYCLES %s %.2f" % (job["name"], took), flush=True)
    if "cover" in job:
        paint.inputs["Material"].default_value = glow("hair's mark", (1, 0, 0))
        if head:
            head.data.materials[0] = glow("skin's mark", (0, 1, 0))
        for thing in bpy.context.scene.objects:
            thing.hide_render = thing.hide_render or thing.type == "LIGHT"
        add_sky(0.0)
        bpy.context.scene.cycles.samples = MASK_SAMPLES
        bpy.context.scene.cycles.max_bounces = 0
        render(os.path.join(folder, job["cover"]))


def main():
    path = sys.argv[sys.argv.index("--") + 1]
    with open(path) as file:
        jobs = json.load(file)
    for job in jobs:
        draw(os.path.dirname(os.path.abspath(path)), job)


main()
