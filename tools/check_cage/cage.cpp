#include "tools/check_cage/cage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

namespace check {
namespace {

// Of a positive tet, seen from outside in a counter-clockwise turn; the i-th is across from corner i.
constexpr std::size_t face_of[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

Box box_of_tet(const TetMesh& mesh, const Tet& tet) {
  Box box;
  for (int v : tet) box.add(mesh.points[std::size_t(v)]);
  return box;
}

int orientation_of(const TetMesh& mesh, const Tet& t) {
  const auto at = [&](std::size_t k) { return mesh.points[std::size_t(t[k])]; };
  return orientation(at(0), at(1), at(2), at(3));
}

// Closed. A flat tet holds nothing.
bool holds(const TetMesh& mesh, const Tet& tet, int positive, const Point& p) {
  for (std::size_t k = 0; k < 4 && positive != 0; ++k) {
    std::array<Point, 4> c;
    for (std::size_t i = 0; i < 4; ++i) c[i] = i == k ? p : mesh.points[std::size_t(tet[i])];
    if (orientation(c[0], c[1], c[2], c[3]) * positive < 0) return false;
  }
  return positive != 0;
}

// Turned so that its lowest node comes first.
Triangle turned(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

struct Faces {
  std::vector<Triangle> boundary;  // outwards
  std::size_t overfull = 0;
  int components = 0;
};

Faces faces_of(const TetMesh& mesh, const std::vector<int>& positive) {
  struct Use {
    Triangle face;
    int tet;
  };
  std::map<Triangle, std::vector<Use>> uses;  // by sorted nodes
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (const auto& corners : face_of) {
      Triangle face;
      for (std::size_t k = 0; k < 3; ++k) face[k] = mesh.tets[t][corners[k]];
      if (positive[t] < 0) std::swap(face[1], face[2]);
      Triangle key = face;
      std::sort(key.begin(), key.end());
      uses[key].push_back({turned(face), int(t)});
    }
  std::vector<int> parent(mesh.tets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int t) {
    while (parent[std::size_t(t)] != t)
      t = parent[std::size_t(t)] = parent[std::size_t(parent[std::size_t(t)])];
    return t;
  };
  Faces faces;
  for (const auto& [key, of_face] : uses) {
    for (const Use& use : of_face) parent[std::size_t(root(use.tet))] = root(of_face[0].tet);
    if (of_face.size() == 1) faces.boundary.push_back(of_face[0].face);
    faces.overfull += of_face.size() > 2 || (of_face.size() == 2 && of_face[0].face == of_face[1].face);
  }
  for (std::size_t t = 0; t < parent.size(); ++t) faces.components += root(int(t)) == int(t);
  return faces;
}

void check_manifold(const std::vector<Triangle>& boundary, CageFacts& facts) {
  std::map<std::pair<int, int>, int> triangles_at_edge;
  std::map<int, std::vector<Triangle>> fan_of_vertex;
  for (const Triangle& t : boundary)
    for (std::size_t k = 0; k < 3; ++k) {
      ++triangles_at_edge[std::minmax(t[k], t[(k + 1) % 3])];
      fan_of_vertex[t[k]].push_back({t[k], t[(k + 1) % 3], t[(k + 2) % 3]});
    }
  for (const auto& [edge, count] : triangles_at_edge) facts.boundary_edges_not_manifold += count != 2;
  for (const auto& [vertex, fan] : fan_of_vertex) {
    // From triangle to triangle round the vertex: one way leads back to the first after all of them.
    std::map<int, int> next;
    for (const Triangle& t : fan) next[t[1]] = t[2];
    std::size_t steps = 0;
    int at = fan[0][1];
    do {
      const auto found = next.find(at);
      at = found == next.end() ? -1 : found->second;
      ++steps;
    } while (at != -1 && at != fan[0][1] && steps <= fan.size());
    facts.boundary_vertices_not_manifold +=
        next.size() != fan.size() || at != fan[0][1] || steps != fan.size();
  }
}

void check_boundary(const Solid& solid, const TetMesh& mesh, const std::vector<Triangle>& boundary,
                    CageFacts& facts) {
  std::vector<Box> boxes;
  std::vector<Corners> corners;
  for (const Triangle& t : boundary) {
    corners.push_back(
        {mesh.points[std::size_t(t[0])], mesh.points[std::size_t(t[1])], mesh.points[std::size_t(t[2])]});
    boxes.emplace_back();
    for (const Point& p : corners.back()) boxes.back().add(p);
  }
  const Grid grid(boxes);
  for (std::size_t i = 0; i < solid.surface().triangles.size(); ++i) {
    const Corners triangle = solid.corners(i);
    Box box;
    for (const Point& p : triangle) box.add(p);
    Meeting found = Meeting::none;
    grid.for_each_meeting(box, [&](int f) {
      if (found != Meeting::crossing) found = std::max(found, meet(triangle, corners[std::size_t(f)]));
    });
    facts.triangles_meeting += found != Meeting::none;
    facts.triangles_crossing += found == Meeting::crossing;
  }
  for (std::size_t i = 0; i < boundary.size(); ++i)
    grid.for_each_meeting(boxes[i], [&](int f) {
      const Triangle& other = boundary[std::size_t(f)];
      const bool apart = std::find_first_of(other.begin(), other.end(), boundary[i].begin(),
                                            boundary[i].end()) == other.end();
      if (std::size_t(f) > i && apart)
        facts.boundary_pairs_crossing += meet(corners[i], corners[std::size_t(f)]) == Meeting::crossing;
    });
}

void measure_tets(const TetMesh& mesh, CageFacts& facts) {
  std::vector<double> smallest;
  facts.min_dihedral_deg = 180;
  for (const Tet& tet : mesh.tets) {
    std::array<Point, 4> p, normal;
    for (std::size_t k = 0; k < 4; ++k) p[k] = mesh.points[std::size_t(tet[k])];
    facts.volume += dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0])) / 6;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& f = face_of[k];
      normal[k] = cross(p[f[1]] - p[f[0]], p[f[2]] - p[f[0]]);
    }
    double least = 180;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j) {
        // The angle between two outward normals is what the dihedral lacks to 180°.
        const double angle =
            180 - std::atan2(length(cross(normal[i], normal[j])), dot(normal[i], normal[j])) * 180 /
                      std::numbers::pi;
        least = std::min(least, angle);
        facts.max_dihedral_deg = std::max(facts.max_dihedral_deg, angle);
      }
    smallest.push_back(least);
    facts.min_dihedral_deg = std::min(facts.min_dihedral_deg, least);
  }
  std::nth_element(smallest.begin(), smallest.begin() + std::ptrdiff_t(smallest.size() / 2), smallest.end());
  facts.median_dihedral_deg = smallest[smallest.size() / 2];
}

}  // namespace

bool CageFacts::holds() const {
  return vertices_outside == 0 && triangles_meeting == 0 && tets_not_positive == 0 && faces_overfull == 0 &&
         boundary_edges_not_manifold == 0 && boundary_vertices_not_manifold == 0 &&
         boundary_pairs_crossing == 0;
}

CageFacts judge_cage(const Solid& solid, TetMesh mesh) {
  if (std::all_of(mesh.tets.begin(), mesh.tets.end(),
                  [&](const Tet& t) { return orientation_of(mesh, t) < 0; }))
    for (Tet& t : mesh.tets) std::swap(t[0], t[1]);
  CageFacts facts;
  facts.surface_vertices = solid.surface().points.size();
  facts.surface_triangles = solid.surface().triangles.size();
  facts.tets = mesh.tets.size();
  facts.surface_closed = solid.closed();
  facts.surface_volume = solid.volume();
  measure_tets(mesh, facts);

  std::vector<Box> boxes;
  std::vector<int> positive;
  for (const Tet& tet : mesh.tets) {
    boxes.push_back(box_of_tet(mesh, tet));
    positive.push_back(orientation_of(mesh, tet));
    facts.tets_not_positive += positive.back() <= 0;
  }
  const Grid grid(boxes);
  for (const Point& p : solid.surface().points) {
    bool inside = false;
    Box box;
    box.add(p);
    grid.for_each_meeting(box, [&](int t) {
      inside = inside || holds(mesh, mesh.tets[std::size_t(t)], positive[std::size_t(t)], p);
    });
    facts.vertices_outside += !inside;
  }
  const Faces faces = faces_of(mesh, positive);
  facts.faces_overfull = faces.overfull;
  facts.components = faces.components;
  facts.boundary_triangles = faces.boundary.size();
  check_manifold(faces.boundary, facts);
  check_boundary(solid, mesh, faces.boundary, facts);
  const GluedFacts glued = find_glued(solid, mesh);
  facts.tets_at_surface = glued.tets_at_surface;
  facts.tets_glued = glued.tets_glued;
  return facts;
}

}  // namespace check
