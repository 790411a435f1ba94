// The fuzzer of all readers (libFuzzer): limber_fuzz --target=NAME [corpus …] [-libFuzzer flags]; with
// --seeds=FOLDER it writes the seeds of every target and ends. tools/fuzz runs it.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "core/error.h"
#include "core/file.h"
#include "meshing/detail/polygon_soup.h"
#include "tests/fuzz/targets.h"

namespace {
const limber::fuzz::Target* chosen = nullptr;

void meet(std::string_view input) {
  try {
    chosen->read(input);
  } catch (const limber::InputError&) {
  }
}

void write_seeds(const limber::fs::path& folder) {
  for (const limber::fuzz::Target& target : limber::fuzz::targets()) {
    limber::make_folder(folder / target.name);
    for (std::size_t i = 0; i < target.seeds.size(); ++i)
      limber::write_file(folder / target.name / fmt::format("seed_{}", i), target.seeds[i]);
    for (std::size_t i = 0; i < target.hostile.size(); ++i)
      limber::write_file(folder / target.name / fmt::format("hostile_{}", i), target.hostile[i]);
    std::puts(target.name.c_str());
  }
}

}  // namespace

// In place of assimp, which runs in a process of its own and is not ours to fuzz.
limber::meshing::detail::PolygonSoup limber::meshing::detail::read_by_assimp(const fs::path&) {
  throw InputError("a format for assimp");
}
std::vector<std::string> limber::meshing::detail::endings_of_assimp() { return {}; }

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (argument.starts_with("--seeds=")) {
      write_seeds(argument.substr(8));
      std::exit(0);
    }
    if (argument.starts_with("--target="))
      for (const limber::fuzz::Target& target : limber::fuzz::targets())
        if (target.name == argument.substr(9)) chosen = &target;
  }
  if (chosen) {
    meet(chosen->seeds.at(0));  // what a target makes once, such as a work folder, is of no input's time
    return 0;
  }
  std::fputs("--target=NAME must name a target\n", stderr);
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  meet({reinterpret_cast<const char*>(data), size});
  return 0;
}
