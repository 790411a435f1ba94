// Models prepared in folders of their own.
#pragma once

#include "limber/detail/body/body_store.h"

namespace limber::detail {

struct PrepareOptions {
  fs::path model, out;
  int shells = 32;       // at most so many convex shells
  double concavity = 0;  // stop cutting below this overshoot, share of the diagonal; 0: only the count rules
  double inflate = 0;    // shells take in all that is this share of the diagonal away
  double threshold = 0;  // the same as CoACD measures: share of half the longest edge of the model's box
  int corners = 64;      // of a shell, at most
  bool exact = false;    // exact convex parts of a small closed model
  int tets = 1000;       // budget of the cage
  std::string mode = "lattice";
  double scale = 1;  // metres a file unit
  bool y_up = false;
  bool preview = false;              // pictures beside the files
  bool picture = false;              // a small one
  std::vector<std::string> exports;  // of export_formats
  double density_kg_m3 = 1000;       // of their masses
  std::string only;                  // as of PrepareSettings
  fs::path store;                    // of bodies; empty: none, or, of many models, store in `out`
  std::string label;                 // of a label map: a number or a name
  double label_gap = 0.2;            // as imaging::SurfaceNetOptions
  int label_rounds = 10;
  double min_island = 8;

  // What shapes a body and what is written beside it, by the names of the command's options.
  template <class Fields>
  void fields(Fields& f) {
    f("shells", shells), f("concavity", concavity), f("inflate", inflate), f("threshold", threshold);
    f("exact", exact), f("shell_corners", corners), f("tets", tets), f("mode", mode), f("scale", scale);
    f("y_up", y_up), f("preview", preview), f("export", exports), f("density", density_kg_m3);
    f("only", only), f("label", label), f("label_gap", label_gap), f("label_smoothing", label_rounds);
    f("least_island", min_island);
  }
};

// What a model's file and how it is read make of BodySource::identity.
struct FileIdentity {
  struct Label {
    std::string name;
    double gap = 0;
    int rounds = 0;
    double least_island = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("name", name), f("gap", gap), f("rounds", rounds), f("least_island", least_island);
    }
  };
  std::string file_hash;
  double scale = 1;
  bool y_up = false;
  std::optional<Label> label;  // of a label map
  template <class Fields>
  void fields(Fields& f) {
    f("file_hash", file_hash), f("scale", scale), f("y_up", y_up), f.if_there("label", label);
  }
};

// Throws InputError where two of them exclude each other.
void require_agreeing(const PrepareOptions&);

PrepareSettings settings_of(const PrepareOptions&);

// The body's model is `file`, and named options.model. Throws InputError when it cannot be read.
BodySource source_of(const PrepareOptions&, const fs::path& file);

struct PreparedModel {
  BodyReport report;                      // with what this run cost
  std::vector<std::string> also_written;  // names of pictures and exports
};
// As source_of. Throws InputError, DiskError.
PreparedModel prepare(const PrepareOptions&, const fs::path& file);

}  // namespace limber::detail
