// The table that `limber verify` prints.
#pragma once

#include <string>
#include <vector>

#include "core/json.h"

namespace limber::detail {

class Promises {
 public:
  void row(const std::string& promise, bool kept, const std::string& value) {
    rows_.push_back({{"promise", promise}, {"kept", kept}, {"value", value}});
    all_kept_ = all_kept_ && kept;
  }
  // What no promise is made of.
  void measured(const std::string& what, const std::string& value) {
    measured_.push_back({{"what", what}, {"value", value}});
  }
  bool all_kept() const { return all_kept_; }
  const std::vector<Json>& rows() const { return rows_; }          // promise, kept, value
  const std::vector<Json>& measured() const { return measured_; }  // what, value

 private:
  std::vector<Json> rows_, measured_;
  bool all_kept_ = true;
};

}  // namespace limber::detail
