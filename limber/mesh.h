// From a dirty model to a certified cage, in memory: arrays in, arrays out. docs/library.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "limber/error.h"
#include "limber/export.h"
#include "limber/watcher.h"

namespace limber {

using Vertices = std::vector<std::array<double, 3>>;     // (V × 3), metres
using Faces = std::vector<std::array<int, 3>>;           // (F × 3), rows of Vertices
using Tetrahedra = std::vector<std::array<int, 4>>;      // (T × 4), rows of Vertices
using Barycentric = std::vector<std::array<double, 4>>;  // (V × 4), each row sums to 1

struct Mesh {
  Vertices vertices;
  Faces faces;  // counter-clockwise seen from outside
};

struct ImportOptions {
  double scale = 1;   // metres a unit of the file, > 0
  bool y_up = false;  // +Y is up in the file; +Z is here
};
struct ImportedMesh {
  Mesh mesh;                                  // the user's own surface, welded and oriented
  std::vector<std::string> mended, warnings;  // sentences: what was done, and what looks wrong
};
// OBJ, PLY, STL, OFF and what assimp reads. Throws InputError where it is no model.
LIMBER_API ImportedMesh load_mesh(const std::filesystem::path&, const ImportOptions& = {},
                                  const Context& = {});
// The same of a mesh in memory. Throws InputError where nothing of it has an area.
LIMBER_API ImportedMesh clean(const Mesh&, const Context& = {});

struct DecomposeOptions {
  int max_convex_hull = 32;    // ≥ 1
  double threshold = 0;        // stop at this concavity, as CoACD measures it: share of half the longest edge
  double concavity = 0;        // the same as a share of the diagonal of the bounding box; 0: only the count
  int max_hull_vertices = 64;  // ≥ 8
  double inflate = 0;          // hulls take in all that is this share of the diagonal away, 0 … 1
  bool exact = false;          // the exact convex parts of a small closed model, as many as it takes
};
struct Decomposition {
  std::vector<Mesh> hulls;  // closed, convex, also when rounded to float32; their union covers the model
  std::vector<std::array<int, 2>> neighbours;
  std::string stopped_by;  // "count", "concavity", "gain" or "exact"
  // Distance of the union's boundary from the model, over the model's diagonal.
  double mean_overshoot = 0, max_overshoot = 0;
  std::int64_t vertices_uncovered = 0, triangles_uncovered = 0;  // exact; 0 of a model that is covered
};
// Throws InputError for a mesh that is none (an index out of range, a coordinate that is not finite, no
// extent), and options out of range.
LIMBER_API Decomposition decompose(const Mesh&, const DecomposeOptions& = {}, const Context& = {});

struct CageOptions {
  int tets = 1000;               // 24 … 200,000
  std::string mode = "lattice";  // or "fast", "paper" (needs hulls), "conform"
};
struct Cage {
  Vertices nodes;
  Tetrahedra tets;                      // of positive volume
  std::vector<int> hull_from_tet = {};  // (T)
  double volume_ratio = 0;              // over the model's; 0 of an open one
  std::vector<std::string> notes = {};  // what the user should know
};
// Encloses the surface, in modes lattice and fast always. Throws InputError as decompose() does.
LIMBER_API Cage build_cage(const Mesh&, const std::vector<Mesh>& hulls, const CageOptions& = {},
                           const Context& = {});

// Exact: proved from the two meshes alone.
struct Certificate {
  bool holds = false;  // every point of every triangle is in the cage, whose boundary is a manifold
  std::int64_t vertices_outside = 0, triangles_crossing = 0;
  int nonmanifold_edges = 0, nonmanifold_vertices = 0, inverted_tets = 0;
  double min_dihedral_deg = 0, max_dihedral_deg = 0;
};
LIMBER_API Certificate certify(const Mesh&, const Cage&, const Context& = {});

struct Binding {
  std::vector<int> tet_from_vertex;  // (V)
  Barycentric weights;               // (V × 4)
  std::int64_t outside = 0;          // vertices in no tet, bound to the nearest by extrapolation
  double max_outside_distance_m = 0;
};
// Throws InputError where a mesh is none.
LIMBER_API Binding bind(const Mesh&, const Cage&, const Context& = {});
// Where the surface is when the cage's nodes are there. Throws InputError where the numbers do not fit.
LIMBER_API Vertices deform(const Binding&, const Tetrahedra&, const Vertices& nodes);

struct PrepareOptions {
  int shells = 32;
  double concavity = 0, threshold = 0, inflate = 0;  // as of DecomposeOptions
  int max_hull_vertices = 64;
  bool exact = false;
  int tets = 1000;
  std::string mode = "lattice";
};

// A model with its hulls, cage, certificate and binding; never changes, cheap to copy.
class LIMBER_API Body {
 public:
  // Of a folder that limber prepare, or save(), has written. Throws InputError.
  static Body load(const std::filesystem::path& folder);
  const Mesh& surface() const;
  const std::vector<Mesh>& hulls() const;  // none of a planned body whose scene asks for none
  const Cage& cage() const;
  const Certificate& certificate() const;
  const Binding& binding() const;
  // What the command tells, as the text of a JSON object: docs/files.md.
  std::string report_json() const;
  // Where the surface is when the cage's nodes are there. Throws InputError where the numbers do not fit.
  Vertices deform(const Vertices& nodes) const;
  // The cage over the surface, small, as the bytes of a PNG.
  std::string picture_png(const Context& = {}) const;
  // The files of docs/files.md. Throws DiskError.
  void save(const std::filesystem::path& folder) const;

  struct Impl;
  explicit Body(std::shared_ptr<const Impl>);
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};
// All of the above in one call, with the bytes that `limber prepare` writes. The surface may get vertices:
// edges longer than the cage's tets are cut. Throws as the functions above do.
LIMBER_API Body prepare(const Mesh&, const PrepareOptions& = {}, const Context& = {});
LIMBER_API Body prepare(const std::filesystem::path& model, const PrepareOptions& = {},
                        const ImportOptions& = {}, const Context& = {});

}  // namespace limber
