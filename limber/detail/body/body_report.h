// report.json of a body's folder: what the body was made from, what came out, what it cost. docs/files.md.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/json_fields.h"

namespace limber::detail {

struct PrepareSettings {
  int shells = 32;  // at most; 0: none are made
  double concavity = 0;
  double threshold = 0;  // as DecomposeOptions::threshold
  double inflate = 0;
  bool exact = false;
  int tets = 1000;
  std::string mode = "lattice";  // "lattice", "fast", "paper", "conform"
  int corners = 64;              // of a shell, at most
  // "shells": no cage, binding and contact; "cage": no shells (but in mode paper, which makes it of them),
  // binding and contact. Such a folder is no body to plan with.
  std::string only;

  // As a report's input has them.
  template <class Fields>
  void fields(Fields& f) {
    f("shells", shells), f("concavity", concavity), f("inflate", inflate), f("exact", exact);
    f("tets", tets), f("mode", mode), f.unless_usual("only", only, {});
    f.unless_usual("corners", corners, 64), f.unless_usual("threshold", threshold, 0.);
  }
  bool has_shells() const { return shells > 0 && (only != "cage" || mode == "paper"); }
  bool has_cage() const { return only != "shells"; }
  bool is_whole() const { return only.empty(); }
};

// What a body was made from: when that is the same, so is the body.
struct BodyInput {
  Json model;  // the identity of its source (BodySource::identity)
  PrepareSettings settings;
  Json all;  // with what nobody chooses
  template <class Fields>
  void fields(Fields& f) {
    f.if_there("model", model), f("settings", settings);
  }
};

// Of report.json all that others ask of it; the rest is for people, and in `json`.
struct BodyReport {
  struct Surface {
    int vertices = 0, triangles = 0;
    double volume_m3 = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("vertices", vertices), f("triangles", triangles), f("volume_m3", volume_m3);
    }
  };
  struct Shells {
    int count = 0, in_float32 = 0, triangles_uncovered = 0;
    int vertices_uncovered = 0;                    // not told by older limbers
    std::string stopped_by;                        // as meshing::Decomposition
    double mean_overshoot = 0, max_overshoot = 0;  // of the diagonal
    std::optional<std::vector<std::array<int, 2>>> neighbours;
    template <class Fields>
    void fields(Fields& f) {
      f("count", count), f("in_float32", in_float32), f("stopped_by", stopped_by);
      f("mean_overshoot", mean_overshoot), f("max_overshoot", max_overshoot);
      f.if_there("vertices_uncovered", vertices_uncovered), f("triangles_uncovered", triangles_uncovered);
      f("neighbours", neighbours);
    }
  };
  struct Cage {
    std::string mode;  // "cells" of a body in cells, else as PrepareSettings
    int tets = 0, nodes = 0;
    double volume_m3 = 0, volume_ratio = 0, glued_share = 0;  // ratio: of the model's volume; 0: it has none
    double min_dihedral_deg = 0, max_dihedral_deg = 0, median_min_dihedral_deg = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("mode", mode), f("tets", tets), f("nodes", nodes);
      f("volume_m3", volume_m3), f("volume_ratio", volume_ratio), f("glued_share", glued_share);
      f("min_dihedral_deg", min_dihedral_deg), f("max_dihedral_deg", max_dihedral_deg);
      f("median_min_dihedral_deg", median_min_dihedral_deg);
    }
  };
  struct Certificate {
    bool holds = false;
    std::int64_t vertices = 0, vertices_outside = 0, triangles = 0, triangles_crossing = 0;
    int nonmanifold_edges = 0, nonmanifold_vertices = 0;
    double min_dihedral_deg = 0, max_dihedral_deg = 0;
    std::string surface_hash, cage_hash;
    template <class Fields>
    void fields(Fields& f) {
      f("holds", holds), f("vertices", vertices), f("vertices_outside", vertices_outside);
      f("triangles", triangles), f("triangles_crossing", triangles_crossing);
      f("nonmanifold_edges", nonmanifold_edges), f("nonmanifold_vertices", nonmanifold_vertices);
      f("min_dihedral_deg", min_dihedral_deg), f("max_dihedral_deg", max_dihedral_deg);
      f("surface_hash", surface_hash), f("cage_hash", cage_hash);
    }
  };
  struct Contact {
    bool usable = false;
    int samples = 0, cells = 0;
    double memory_mb = 0, error_p99_m = 0, error_max_m = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("usable", usable), f("samples", samples), f("error_p99_m", error_p99_m);
      f("error_max_m", error_max_m), f("memory_mb", memory_mb), f("cells", cells);
    }
  };
  struct Appearance {
    int materials = 0;
    std::vector<Json> images;
    bool corner_colors = false;
    template <class Fields>
    void fields(Fields& f) {
      f.if_there("materials", materials), f.if_there("images", images);
      f.if_there("corner_colors", corner_colors);
    }
  };

  std::string version;  // of the limber that wrote it
  std::string model;    // a file's name, or words for a made model
  BodyInput input;
  std::vector<std::string> mended, warnings;
  Surface surface;
  std::optional<Shells> shells;  // these four: of what was made
  std::optional<Cage> cage;
  std::optional<Certificate> certificate;
  std::optional<Contact> contact;
  std::optional<Appearance> appearance;       // of a model with colors of its own
  std::map<std::string, double> cpu_seconds;  // by stage; empty where nothing was made
  double peak_memory_mb = 0;
  std::map<std::string, std::string> files;  // name → hash
  Json json;                                 // as it is written

  // Of a part of a body, without what is not made.
  template <class Fields>
  void fields(Fields& f) {
    f("version", version), f("model", model), f("input", input), f("input", input.all);
    f("mended", mended), f("warnings", warnings), f("surface", surface);
    if (input.settings.has_shells()) f("shells", shells.emplace());
    if (input.settings.has_cage()) f("cage", cage.emplace()), f("certificate", certificate.emplace());
    if (input.settings.is_whole()) f("contact", contact.emplace());
    f.if_there("appearance", appearance), f("cpu_seconds", cpu_seconds);
    f("peak_memory_mb", peak_memory_mb), f("files", files);
  }
  bool has_file(const std::string& name, const std::string& hash) const {
    const auto found = files.find(name);
    return found != files.end() && found->second == hash;
  }
};

// Throws InputError naming the key that is missing or of another kind.
BodyReport body_report_of(Json, const std::string& file);
BodyReport read_body_report(const fs::path& folder);
// A report that tells nothing of this run.
void take_costs_out(Json& report);

}  // namespace limber::detail
