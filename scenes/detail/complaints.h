// The first complaint about a scene, or all of them.
#pragma once

#include <string>
#include <vector>

#include "core/error.h"

namespace limber::scenes {

class Complaints {
 public:
  explicit Complaints(std::vector<std::string>* all = nullptr) : all_(all) {}  // null: the first is thrown

  template <class Check>
  void during(Check check) const {
    if (!all_) return check();
    try {
      check();
    } catch (const InputError& error) {
      all_->push_back(error.what());
    }
  }
  bool any() const { return all_ && !all_->empty(); }

 private:
  std::vector<std::string>* all_;
};

}  // namespace limber::scenes
