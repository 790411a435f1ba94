// Every reader of limber as a function of bytes, for the fuzzer (tools/fuzz) and for the tests that run over
// its seeds.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace limber::fuzz {

struct Target {
  std::string name;
  // Reads the bytes as a file of its kind. InputError is an answer; anything else that is thrown is a
  // finding.
  std::function<void(std::string_view bytes)> read;
  std::vector<std::string> seeds;  // good files, all of which read() takes
  // Files that once crashed, hung or ate the memory of whoever read them: each is an InputError.
  std::vector<std::string> hostile = {};
};

const std::vector<Target>& targets();

}  // namespace limber::fuzz
