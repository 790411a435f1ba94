#!/usr/bin/python3
# netgen_mesh.py IN.stl OUT.msh MAXH: netgen on a closed surface, grading 0.7. (Debian's own Python knows netgen.)
import sys
from netgen.stl import LoadSTLGeometry

mesh = LoadSTLGeometry(sys.argv[1]).GenerateMesh(maxh=float(sys.argv[3]), grading=0.7)
mesh.Export(sys.argv[2], "Gmsh2 Format")
