// What the fuzzer starts from, without the fuzzer: each seed is read, and no cut or changed byte of one gives
// anything but an answer.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/error.h"
#include "core/npz.h"
#include "core/random.h"
#include "scenes/scene.h"
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

// A prefix of TOML can be TOML. One that can be planned lacks no required key: it reaches into the goal's
// radius.
TEST(Seeds, APrefixOfASceneIsRefusedUpToItsLastRequiredKey) {
  for (const Target& target : targets())
    if (target.name == "scene") {
      const std::string& scene = target.seeds[0];
      const std::size_t last_required = scene.find("radius_m = ");
      ASSERT_LT(last_required, scene.size());
      for (std::size_t size = 0; size < last_required; ++size)
        EXPECT_THROW(scenes::require_plannable(scenes::read_scene(scene.substr(0, size), "prefix")),
                     InputError)
            << size;
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

std::string bytes_of(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += char(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

// What once came out as a defect of limber: a report whose contact is none, a tet of a shell that is none.
TEST(Seeds, ChangedFoldersThatOnceEscapedAreRefused) {
  for (const char* script : {"987e3acf7b755c82492b6025bc2b3c5c11bef90514f702a6dbdb8daabedfc75bf436d4f2770e"
                             "622e3e31b65c125e52b67882b2fd520fe37e48d43009e4",
                             "20973fbb1046905ad1f2a72c83a2e2afa7e878f5238e2c7773ea9c35b9d2d5405ae91f394687"
                             "6ae7b954f0797795"})
    EXPECT_THROW(meet_changed_folder(bytes_of(script)), InputError) << script;
}

// Of all inputs that hours of fuzzing kept, those that reach what no other of them reaches.
TEST(Seeds, EveryInputOfTheKeptCorporaIsAnAnswer) {
  for (const Target& target : targets()) {
    const fs::path corpus = fs::path(LIMBER_CORPORA) / (target.name + ".zip");
    if (!target.name.ends_with("_changed")) continue;
    const Npz kept = read_npz(corpus);
    EXPECT_GT(kept.texts.size(), 20u) << corpus;
    for (const auto& [name, input] : kept.texts) {
      SCOPED_TRACE(target.name + " " + name);
      try {
        target.read(input);
      } catch (const InputError&) {
      } catch (const std::exception& error) {
        ADD_FAILURE() << error.what();
      }
    }
  }
}

// Bytes drawn blindly reach far where they are read as edits.
TEST(Seeds, NoScriptOfEditsEscapesAsAnythingButInputError) {
  const char* const more = std::getenv("LIMBER_FUZZ_SCRIPTS");
  const int scripts = more ? std::atoi(more) : 60;
  Rng rng(20260112, 1);
  for (const Target& target : targets()) {
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
