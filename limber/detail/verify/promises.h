// What is promised of a folder, and whether it is kept.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "limber/work_folder.h"

namespace limber::detail {

class Promises {
 public:
  void row(const std::string& promise, bool kept, const std::string& value) {
    rows_.push_back({promise, value, kept});
    all_kept_ = all_kept_ && kept;
  }
  void measured(const std::string& what, const std::string& value) { measured_.push_back({what, value}); }
  void add(Promises&& others) {  // behind these
    std::move(others.rows_.begin(), others.rows_.end(), std::back_inserter(rows_));
    std::move(others.measured_.begin(), others.measured_.end(), std::back_inserter(measured_));
    all_kept_ = all_kept_ && others.all_kept_;
  }
  bool all_kept() const { return all_kept_; }
  const std::vector<Promise>& rows() const { return rows_; }
  const std::vector<Finding>& measured() const { return measured_; }

 private:
  std::vector<Promise> rows_;
  std::vector<Finding> measured_;
  bool all_kept_ = true;
};

}  // namespace limber::detail
