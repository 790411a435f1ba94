// Models prepared in folders of their own.
#pragma once

#include "limber/body_folder.h"
#include "limber/detail/body/body_store.h"

namespace limber::detail {

// What a model's file and how it is read make of BodySource::identity.
struct FileIdentity {
  struct Label {
    std::string name;
    double gap = 0;
    int rounds = 0;
    double min_island = 0;
    template <class Fields>
    void fields(Fields& f) {
      f("name", name), f("gap", gap), f("rounds", rounds), f("least_island", min_island);
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

PrepareSettings settings_of(const PrepareOptions&);
PrepareSettings settings_of(const ModelOptions&);

// The body's model is `file`, and named options.model. Throws InputError when it cannot be read.
BodySource source_of(const ModelOptions&, const fs::path& file);

// As source_of. Throws InputError, DiskError.
PreparedFolder prepare(const ModelOptions&);

}  // namespace limber::detail
