#include "limber/detail/world/kept_share.h"

#include "core/content_hash.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"

namespace limber::detail {

bool has_stiffness_share(const fem::BodySpec& body) {
  return body.kind == fem::BodyKind::deformable && body.material.mesh_independent;
}

std::string stiffness_key_of(const fem::BodySpec& body) {
  const fem::Material& m = body.material;
  const Json all{{"cage", hex(hash_of(body.cage))},
                 {"fixed_nodes", body.fixed_nodes},
                 {"springs", m.model == fem::MaterialModel::springs},
                 {"youngs_modulus_pa", m.youngs_modulus_pa},
                 {"poisson_ratio", m.poisson_ratio},
                 {"density_kg_m3", m.density_kg_m3},
                 {"youngs_modulus_from_tet_pa", body.youngs_modulus_from_tet_pa},
                 {"density_from_tet_kg_m3", body.density_from_tet_kg_m3},
                 {"program", program_hash()}};
  return content_hash(text_of(all));
}

namespace {

KeptShare::Entry entry_of(const std::string& key, double share) {
  return {share, content_hash(key + text_of(Json(share)))};
}

}  // namespace

KeptShare::KeptShare(const fs::path& body_folder, const fem::BodySpec& body)
    : file_(body_folder / "stiffness.json"),
      key_(stiffness_key_of(body)),
      is_of_use_(has_stiffness_share(body)) {
  if (!is_of_use_ || !fs::exists(file_)) return;
  try {
    for (const auto& [key, told] : read_fields<InOrder<Json>>(read_json(file_), "", ""))
      if (const auto entry = fields_or_nothing<Entry>(told); entry && *entry == entry_of(key, entry->share))
        kept_.emplace_back(key, *entry);
  } catch (const InputError&) {
  }
  for (const auto& [key, entry] : kept_)
    if (key == key_) share_ = entry.share;
}

void KeptShare::keep(double found) {
  if (!is_of_use_ || share_ > 0) return;
  share_ = found;
  kept_.emplace_back(key_, entry_of(key_, found));
  write_json(file_, json_of_fields(kept_));
}

}  // namespace limber::detail
