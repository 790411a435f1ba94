#include "limber/detail/world/kept_share.h"

#include "core/content_hash.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/log.h"

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

using Entries = InOrder<KeptShare::Entry>;

Entries sound_entries(const fs::path& file) {
  Entries entries;
  if (!fs::exists(file)) return entries;
  try {
    for (const auto& [key, told] : read_fields<InOrder<Json>>(read_json(file), "", ""))
      if (const auto entry = fields_or_nothing<KeptShare::Entry>(told);
          entry && *entry == entry_of(key, entry->share))
        entries.emplace_back(key, *entry);
  } catch (const InputError&) {
  }
  return entries;
}

// 0: there is none.
double share_in(const Entries& entries, const std::string& key) {
  for (const auto& [other, entry] : entries)
    if (other == key) return entry.share;
  return 0;
}

}  // namespace

KeptShare::KeptShare(const fs::path& body_folder, const fem::BodySpec& body, const fs::path& store)
    : file_(body_folder / "stiffness.json"),
      key_(stiffness_key_of(body)),
      is_of_use_(has_stiffness_share(body)) {
  if (!is_of_use_) return;
  kept_ = sound_entries(file_);
  share_ = share_in(kept_, key_);
  if (store.empty()) return;
  in_store_ = store / "stiffness" / (key_ + ".json");
  const double stored = share_in(sound_entries(in_store_), key_);
  is_stored_ = stored > 0;
  if (share_ == 0) share_ = stored;
}

void KeptShare::keep(double found) {
  if (!is_of_use_) return;
  share_ = found;
  if (share_in(kept_, key_) == 0) {
    kept_.emplace_back(key_, entry_of(key_, found));
    write_json(file_, json_of_fields(kept_));
  }
  if (in_store_.empty() || is_stored_) return;
  is_stored_ = true;
  try {
    make_folder(in_store_.parent_path());
    write_json(in_store_, json_of_fields(Entries{{key_, entry_of(key_, found)}}));
  } catch (const DiskError& error) {
    log::warn("the store keeps no share of stiffness: {}", error.what());
  }
}

}  // namespace limber::detail
