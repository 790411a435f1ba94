// A share of stiffness (fem::Body::stiffness_share) takes seconds to find, and depends on one body alone: it
// is kept beside it.
#pragma once

#include <string>

#include "core/file.h"
#include "core/json_fields.h"
#include "fem/world.h"

namespace limber::detail {

// Whether there is a share to find.
bool has_stiffness_share(const fem::BodySpec&);
// A hash of all that it depends on, the program too.
std::string stiffness_key_of(const fem::BodySpec&);

// stiffness.json of a body's folder: the shares that were found, each under a hash of all that it depends on,
// the program too, and with one of itself. What is damaged is not there. And in a store of bodies, where
// there is one, a file of each share, by the same hash.
class KeptShare {
 public:
  KeptShare(const fs::path& body_folder, const fem::BodySpec& in_its_own_frame, const fs::path& store = {});
  double share() const { return share_; }  // 0: not known
  // Of fem::Body; does nothing where it is of no use. Throws DiskError.
  void keep(double found);

  struct Entry {
    double share = 0;
    std::string hash;
    bool operator==(const Entry&) const = default;
    template <class Fields>
    void fields(Fields& f) {
      f.within("share", share, fem::min_stiffness_share, fem::max_stiffness_share), f("hash", hash);
    }
  };

 private:
  fs::path file_, in_store_;
  std::string key_;
  InOrder<Entry> kept_;
  double share_ = 0;
  bool is_of_use_, is_stored_ = false;
};

}  // namespace limber::detail
