"""blender -b --factory-startup --python blender.py -- gltf|pc2|usd FOLDER PLACES OUT.npz: loads what limber exported into FOLDER,
and keeps the vertices of all meshes, in the world, at each of PLACES: JSON, [[frames after the first, seconds after it], …]."""
import json, os, runpy, sys
import bpy
import numpy as np

form, folder, places, out = sys.argv[-4:]
scene = bpy.context.scene
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
if form == "pc2":
    runpy.run_path(os.path.join(folder, "pc2", "load_in_blender.py"), run_name="__main__")
elif form == "usd":
    bpy.ops.wm.usd_import(filepath=os.path.join(folder, "motion.usda"))
else:
    np.bool = bool  # Debian's Blender 3.4 asks numpy 1.24 for a name that it no longer has
    import addon_utils

    addon_utils.enable("io_scene_gltf2")
    bpy.ops.import_scene.gltf(filepath=os.path.join(folder, "motion.glb"))
shown = {}
for place, seconds in json.loads(places):
    at = seconds * scene.render.fps / scene.render.fps_base if form == "gltf" else scene.frame_start + place
    scene.frame_set(int(at), subframe=at - int(at))
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in bpy.data.objects:
        if thing.type != "MESH":
            continue
        seen = thing.evaluated_get(graph)
        points = np.empty(3 * len(seen.data.vertices))
        seen.data.vertices.foreach_get("co", points)
        world = np.array(seen.matrix_world)
        shown[f"{thing.name}/{place}"] = points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
np.savez(out, **shown)
