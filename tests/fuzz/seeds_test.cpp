// What the fuzzer starts from, without the fuzzer: each seed is read, and no cut or changed byte of one gives
// anything but an answer.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/error.h"
#include "core/random.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/targets.h"

namespace limber::fuzz {
namespace {

TEST(Seeds, EachIsTaken) {
  for (const Target& target : targets())
    for (const std::string& seed : target.seeds) EXPECT_NO_THROW(target.read(seed)) << target.name;
}

TEST(Seeds, EachHostileOneIsRefused) {
  for (const Target& target : targets())
    for (std::size_t i = 0; i < target.hostile.size(); ++i)
      EXPECT_THROW(target.read(target.hostile[i]), InputError) << target.name << " " << i;
}

TEST(Seeds, EveryPrefixIsAnAnswer) {
  for (const Target& target : targets())
    for (const std::string& seed : target.seeds)
      for (std::size_t size = 0; size < seed.size(); size += target.name == "model" ? 7 : 1) {
        SCOPED_TRACE(fmt::format("{} cut to {} of {} bytes", target.name, size, seed.size()));
        try {
          target.read(std::string_view(seed).substr(0, size));
        } catch (const InputError&) {
        }
      }
}

// A prefix of TOML can be TOML. One that is taken lacks no required key: it reaches into the goal's radius.
TEST(Seeds, APrefixOfASceneIsRefusedUpToItsLastRequiredKey) {
  for (const Target& target : targets())
    if (target.name == "scene") {
      const std::string& scene = target.seeds[0];
      const std::size_t last_required = scene.find("radius_m = ");
      ASSERT_LT(last_required, scene.size());
      for (std::size_t size = 0; size < last_required; ++size)
        EXPECT_THROW(target.read(scene.substr(0, size)), InputError) << size;
    }
}

TEST(Seeds, NoChangedByteEscapesAsAnythingButInputError) {
  Rng rng(20060515, 7);
  for (const Target& target : targets())
    for (const std::string& seed : target.seeds)
      for (int trial = 0; trial < 100; ++trial) {
        std::string changed = seed;
        changed[std::size_t(rng.below(int(seed.size())))] = char(rng.below(256));
        SCOPED_TRACE(target.name);
        try {
          target.read(changed);
        } catch (const InputError&) {
        }
      }
}

// Bytes drawn blindly reach far where they are read as edits.
TEST(Seeds, NoScriptOfEditsEscapesAsAnythingButInputError) {
  const char* const more = std::getenv("LIMBER_FUZZ_SCRIPTS");
  const int scripts = more ? std::atoi(more) : 60;
  Rng rng(20260112, 1);
  std::vector<Target> all = targets();
  all.push_back({"folder_changed", meet_changed_folder, {}});
  for (const Target& target : all) {
    if (!target.name.ends_with("_changed")) continue;
    for (int trial = 0; trial < scripts; ++trial) {
      std::string script(std::size_t(4 + rng.below(60)), '\0');
      for (char& byte : script) byte = char(rng.below(256));
      SCOPED_TRACE(fmt::format("{}, script {}", target.name, trial));
      try {
        target.read(script);
      } catch (const InputError&) {
      } catch (const std::exception& error) {
        ADD_FAILURE() << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace limber::fuzz
