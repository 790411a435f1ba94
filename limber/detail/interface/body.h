// What a Body of the interface holds.
#pragma once

#include <optional>

#include "limber/detail/body/body.h"
#include "limber/mesh.h"

namespace limber {

struct [[gnu::visibility("hidden")]] Body::Impl {
  Mesh surface;
  std::vector<Mesh> hulls;
  Cage cage;
  Certificate certificate;
  Binding binding;
  Json report;
  // One of the two: made here, or read from a folder.
  struct Made {
    detail::WholeBody whole;
    detail::BodySource source;
    detail::PrepareSettings settings;
  };
  std::optional<Made> made;
  std::filesystem::path folder;
  std::map<std::string, std::string> files;  // of it, name → hash
  // What its cage moves; `rest` where it bends by Phong Deformation.
  ffd::Binding bound;
  TetMesh rest;
  NodeGradients gradients;
  bool phong = false;
};

namespace detail {
Body body_of(const detail::PreparedBody&, const std::filesystem::path& folder);
}

}  // namespace limber
