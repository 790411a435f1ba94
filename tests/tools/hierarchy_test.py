"""hierarchy_test.py LIMBER: tools/hierarchy of a cube in an empty room, whose cages have five tets a cell."""
import os
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

TOOL = pathlib.Path(__file__).resolve().parent.parent.parent / "tools" / "hierarchy"
SCENE = """
name = "cube"
[world]
bounds_m = [[0, 0, 0], [4, 2, 2]]
gravity_m_s2 = [0, 0, 0]
[[bodies]]
name = "cube"
role = "robot"
model = { box = { size_m = [0.6, 0.6, 0.6], bevel_m = 0.05, triangle_m = 0.2 } }
cage = { cells = [2, 2, 2] }
material = { youngs_modulus_pa = 3e3, poisson_ratio = 0.45, density_kg_m3 = 100 }
pose = { position_m = [1, 1, 1] }
[goal]
center_of_mass_m = [2.8, 1, 1]
radius_m = 0.3
[planner]
iterations = 200
max_force_n = 50
"""


def tables(text):
    """Each as a list of rows, a row as {column: cell}."""
    found = []
    for block in text.split("\n\n"):
        lines = [line.split("|")[1:-1] for line in block.splitlines() if line.startswith("|")]
        lines = [[cell.strip() for cell in line] for line in lines]
        if lines:
            found.append([dict(zip(lines[0], line)) for line in lines[2:]])
    return found


def main():
    with tempfile.TemporaryDirectory() as folder:
        scene, out, svg = (pathlib.Path(folder) / name for name in ("scene.toml", "out", "plot.svg"))
        scene.write_text(SCENE)
        command = [sys.executable, TOOL, out, "--scenes", scene, "--tets", "40,135", "--seeds", "1", "--forces", "0.5"]

        def hierarchy(*more):
            environment = {**os.environ, "LIMBER": sys.argv[1]}
            done = subprocess.run(command + list(more), env=environment, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            return done

        first = hierarchy("--verify", "--svg", svg)
        costs, carried, gains = tables(first.stdout)
        assert [row["soft tets"] for row in costs] == ["40", "135"], costs  # five a cell
        assert [row["nodes"] for row in costs] == ["27", "64"], costs
        assert [row["solved"] for row in costs] == ["1 of 1", "1 of 1"], costs
        assert float(costs[0]["step, ms"]) > float(costs[1]["step, ms"]) > 0, costs
        assert gains[0]["how"] in ("replayed", "tracked"), gains
        assert [row["asked"] for row in carried] == ["135"], carried
        assert int(carried[0]["replayed"]) + int(carried[0]["followed"]) == 1, carried
        assert carried[0]["all promises kept"] == "1 of 1", carried
        assert float(carried[0]["carried: m from the goal"]) <= 0.3, carried
        assert 0 < float(carried[0]["apart, mean, m"]) < float(carried[0]["at most, m"]) < 2, carried  # a push of 2 m
        coarse, refined, anew, times = (float(gains[0][c]) for c in list(gains[0])[2:] if c != "how")
        assert abs(anew / (coarse + refined) / times - 1) < 0.2, gains  # of figures with two digits
        xml.etree.ElementTree.parse(svg)
        for again in (hierarchy(), hierarchy("--tell")):  # what is there is not made again
            assert again.stdout == first.stdout and again.stderr == "", again.stderr


main()
