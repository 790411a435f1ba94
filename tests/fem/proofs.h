// The seventeen proofs that the dynamics are right (docs/dynamics.md, "Proofs"), each a measured value beside
// its tolerance. A run of a whole suite prints the table of all it proved; LIMBER_WRITE_DOCS=1 also writes it
// into the page, between the markers that bear the suite's name.
#pragma once

#include <errno.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>

#include "core/file.h"
#include "tests/places.h"

namespace limber::fem::testing {

struct Proof {
  double measured, tolerance;
  bool at_most;  // else at least
  std::string where;
  int cases = 1;
  bool holds() const { return at_most ? measured <= tolerance : measured >= tolerance; }
};

// By number and what was measured; of the cases the worst.
inline std::map<std::pair<int, std::string>, Proof>& proofs() {
  static std::map<std::pair<int, std::string>, Proof> all;
  return all;
}

inline void record(int number, const std::string& what, Proof proof) {
  EXPECT_TRUE(proof.holds()) << "proof " << number << ", " << what << ", " << proof.where << ": measured "
                             << proof.measured << (proof.at_most ? ", at most " : ", at least ")
                             << proof.tolerance;
  const auto [place, added] = proofs().try_emplace({number, what}, proof);
  if (added) return;
  Proof& worst = place->second;
  const bool better =
      proof.at_most ? proof.measured <= worst.measured : proof.measured >= worst.measured;  // false for NaN
  proof.cases = worst.cases + 1;
  if (better)
    worst.cases = proof.cases;
  else
    worst = proof;
}
inline void prove_at_most(int number, const std::string& what, const std::string& where, double measured,
                          double tolerance) {
  record(number, what, {measured, tolerance, true, where});
}
inline void prove_at_least(int number, const std::string& what, const std::string& where, double measured,
                           double tolerance) {
  record(number, what, {measured, tolerance, false, where});
}

inline std::string table_of_proofs() {
  std::string table =
      "| | what | measured | tolerance | cases, the worst | holds |\n|---|---|---|---|---|---|\n";
  for (const auto& [key, proof] : proofs())
    table += fmt::format("| {} | {} | {:.3g} | {} {:.3g} | {}: {} | {} |\n", key.first, key.second,
                         proof.measured, proof.at_most ? "≤" : "≥", proof.tolerance, proof.cases, proof.where,
                         proof.holds() ? "yes" : "NO");
  return table;
}

class TableOfProofs : public ::testing::Environment {
  void TearDown() override {
    if (proofs().empty() || ::testing::GTEST_FLAG(filter) != "*") return;
    const std::string table = table_of_proofs();
    fmt::print("\n{}\n", table);
    if (!std::getenv("LIMBER_WRITE_DOCS")) return;
    const fs::path page = fs::path(limber_source_dir) / "docs/dynamics.md";
    std::string text = read_file(page);
    const std::string suite = program_invocation_short_name,
                      from = fmt::format("<!-- proofs: written by LIMBER_WRITE_DOCS=1 {} -->\n", suite),
                      to = fmt::format("<!-- end of proofs of {} -->\n", suite);
    const std::size_t first = text.find(from), last = text.find(to);
    ASSERT_TRUE(first != std::string::npos && last != std::string::npos)
        << page << " has no place for " << suite;
    text.replace(first + from.size(), last - first - from.size(), table);
    write_file(page, text);
  }
};
inline ::testing::Environment* const printed_last = ::testing::AddGlobalTestEnvironment(new TableOfProofs);

}  // namespace limber::fem::testing
