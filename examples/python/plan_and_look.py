"""Plans a scene, throws a handful of pushes at its world, and films it: plan_and_look.py [SCENE [FOLDER]]."""
import sys

import limber

scene, folder = (sys.argv[1:] + ["barriers1", "out/python"][len(sys.argv) - 1:])[:2]
plan = limber.plan(scene, folder, preset="fast", seed=1)
print(plan.why)
print(f"tree {plan.tree_hash}, trajectory {plan.trajectory_hash}")

world = limber.World(limber.Scene(scene, preset="fast"), folder)
ends = world.rollout(world.start(8), limber.pushes(8, force_n=[(10 * i, 0, 0) for i in range(8)], steps=50))
print(world.robot_centers(ends))

print(limber.render(folder, size=(320, 180)).video)
for promise in limber.verify(folder):
    print("kept  " if promise.kept else "BROKEN", promise.name)
