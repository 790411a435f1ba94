// Prepared bodies kept under what they are made of, to be shared by batches, scenes and machines.
// docs/batch.md.
#pragma once

#include <optional>
#include <string>

#include "limber/detail/body/body.h"

namespace limber::detail {

// An entry is a body's folder, STORE/ab/abcd…, whose report tells no model's name and no costs, so that
// whoever makes it makes the same bytes. Its report is written last: an entry without one is none. Files are
// hard links where the disk has them, and may not be written to.
class BodyStore {
 public:
  // Throws DiskError where the folder cannot be made.
  explicit BodyStore(fs::path folder);

  // Depends on the model's bytes, what shapes the body, and this build of limber.
  static std::string key_of(const BodySource&, const Json& input);

  bool has(const std::string& key) const;
  bool has_picture(const std::string& key) const;
  // Makes `folder` the body of that key, and returns its report; nothing where there is no such entry, or a
  // damaged one. `folder` is there, and nobody else writes into it.
  std::optional<BodyReport> fetch(const std::string& key, const Json& input, const std::string& model,
                                  const fs::path& folder) const;
  // Keeps the body in `folder`, and its picture where there is one; warns where the store cannot be written.
  void keep(const std::string& key, const fs::path& folder) const;
  void keep(const std::string& key, const fs::path& folder, const BodyReport&) const;  // its report, read

 private:
  fs::path entry(const std::string& key) const { return folder_ / key.substr(0, 2) / key; }
  fs::path folder_;
};

}  // namespace limber::detail
