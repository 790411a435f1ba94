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
};

// Throws InputError where two of them exclude each other.
void require_agreeing(const PrepareOptions&);

PrepareSettings settings_of(const PrepareOptions&);

// The body's model is `file`, and named options.model. Throws InputError when it cannot be read.
BodySource source_of(const PrepareOptions&, const fs::path& file);

struct PreparedModel {
  Json report;                            // report.json, with what this run cost
  std::vector<std::string> also_written;  // names of pictures and exports
};
// As source_of. Throws InputError, DiskError.
PreparedModel prepare(const PrepareOptions&, const fs::path& file);

}  // namespace limber::detail
