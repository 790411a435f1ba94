#include "scenes/anatomy.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

namespace limber::scenes {

namespace {

constexpr const char *bone_color = "#e8dfc8", *skin_color = "#c98f70";

// What is meant more narrowly stands before what is meant more widely.
constexpr Anatomy table[] = {
    {"skin", PartKind::hull, 0, 0, skin_color},
    {"body", PartKind::hull, 0, 0, skin_color},
    {"ribcage", PartKind::hull, 0, 0, bone_color},

    {"hippocamp*", PartKind::soft, 3e3, 1040, "#e4b8ab"},
    {"spinal cord", PartKind::soft, 1e4, 1040, "#ead9a6"},
    {"pulmonary vein", PartKind::soft, 5e4, 1060, "#a4404a"},
    {"pulmonary artery", PartKind::soft, 5e4, 1060, "#5566a0"},
    {"portal vein", PartKind::soft, 5e4, 1060, "#5566a0"},
    {"vena", PartKind::soft, 5e4, 1060, "#5566a0"},
    {"vein", PartKind::soft, 5e4, 1060, "#5566a0"},
    {"aort*", PartKind::soft, 5e4, 1060, "#b8352f"},
    {"arter*", PartKind::soft, 5e4, 1060, "#b8352f"},
    {"trunk", PartKind::soft, 5e4, 1060, "#b8352f"},
    {"atrial appendage", PartKind::soft, 5e3, 1050, "#b0413e"},

    {"cartilage", PartKind::bone, 0, 0, "#cfd8d2"},
    {"spine", PartKind::bone, 0, 0, bone_color},
    {"rib", PartKind::bone, 0, 0, bone_color},
    {"skull*", PartKind::bone, 0, 0, bone_color},
    {"cranium", PartKind::bone, 0, 0, bone_color},
    {"mandible", PartKind::bone, 0, 0, bone_color},
    {"maxilla", PartKind::bone, 0, 0, bone_color},
    {"tooth", PartKind::bone, 0, 0, bone_color},
    {"teeth", PartKind::bone, 0, 0, bone_color},
    {"pelvi*", PartKind::bone, 0, 0, bone_color},
    {"hip", PartKind::bone, 0, 0, bone_color},
    {"bone", PartKind::bone, 0, 0, bone_color},
    {"skeleton", PartKind::bone, 0, 0, bone_color},
    {"vertebra*", PartKind::bone, 0, 0, bone_color},
    {"sternum", PartKind::bone, 0, 0, bone_color},
    {"sacrum", PartKind::bone, 0, 0, bone_color},
    {"coccyx", PartKind::bone, 0, 0, bone_color},
    {"scapula*", PartKind::bone, 0, 0, bone_color},
    {"clavic*", PartKind::bone, 0, 0, bone_color},
    {"humer*", PartKind::bone, 0, 0, bone_color},
    {"radius", PartKind::bone, 0, 0, bone_color},
    {"ulna*", PartKind::bone, 0, 0, bone_color},
    {"femur", PartKind::bone, 0, 0, bone_color},
    {"femora", PartKind::bone, 0, 0, bone_color},
    {"patella*", PartKind::bone, 0, 0, bone_color},
    {"tibia*", PartKind::bone, 0, 0, bone_color},
    {"fibula*", PartKind::bone, 0, 0, bone_color},
    {"carpal", PartKind::bone, 0, 0, bone_color},
    {"metacarpal", PartKind::bone, 0, 0, bone_color},
    {"tarsal", PartKind::bone, 0, 0, bone_color},
    {"metatarsal", PartKind::bone, 0, 0, bone_color},
    {"phalan*", PartKind::bone, 0, 0, bone_color},

    {"heart", PartKind::soft, 5e3, 1050, "#b0413e"},
    {"ventric*", PartKind::soft, 5e3, 1050, "#b0413e"},
    {"atri*", PartKind::soft, 5e3, 1050, "#b0413e"},
    {"lung*", PartKind::soft, 1.5e4, 400, "#e0a3a0"},
    {"liver", PartKind::soft, 1e4, 1050, "#8c4a3a"},
    {"kidney*", PartKind::soft, 1e4, 1050, "#8f4b45"},
    {"stomach", PartKind::soft, 5e3, 1050, "#d9a08a"},
    {"spleen", PartKind::soft, 1e4, 1050, "#7b3f52"},
    {"pancreas", PartKind::soft, 5e3, 1050, "#e3b778"},
    {"trachea", PartKind::soft, 5e4, 1100, "#cfd8d2"},
    {"bronch*", PartKind::soft, 5e4, 1100, "#cfd8d2"},
    {"larynx", PartKind::soft, 5e4, 1100, "#cfd8d2"},
    {"diaphragm", PartKind::soft, 2e4, 1050, "#b5695f"},
    {"brain*", PartKind::soft, 3e3, 1040, "#e4b8ab"},
    {"cerebell*", PartKind::soft, 3e3, 1040, "#e4b8ab"},
    {"cerebr*", PartKind::soft, 3e3, 1040, "#e4b8ab"},
    {"gallbladder", PartKind::soft, 1e4, 1030, "#6f8f4a"},
    {"bladder", PartKind::soft, 1e4, 1040, "#d8b56a"},
    {"esophag*", PartKind::soft, 2e4, 1040, "#c98878"},
    {"oesophag*", PartKind::soft, 2e4, 1040, "#c98878"},
    {"duoden*", PartKind::soft, 5e3, 1040, "#d49a84"},
    {"bowel", PartKind::soft, 5e3, 1040, "#d9a08a"},
    {"intestin*", PartKind::soft, 5e3, 1040, "#d9a08a"},
    {"colon", PartKind::soft, 5e3, 1040, "#c68f7a"},
    {"rect*", PartKind::soft, 5e3, 1040, "#c68f7a"},
    {"adrenal", PartKind::soft, 1e4, 1030, "#dbb25e"},
    {"thyroid", PartKind::soft, 1e4, 1050, "#a8524b"},
    {"thymus", PartKind::soft, 5e3, 1030, "#e0b59a"},
    {"prostate", PartKind::soft, 2e4, 1050, "#b98a72"},
    {"uter*", PartKind::soft, 2e4, 1050, "#c9797a"},
    {"ovar*", PartKind::soft, 1e4, 1050, "#d8a59a"},
    {"testi*", PartKind::soft, 1e4, 1040, "#d8b7a2"},
    {"tongue", PartKind::soft, 1e4, 1050, "#c4646a"},
    {"eye*", PartKind::soft, 2e4, 1040, "#e9e4dc"},
    {"fat", PartKind::soft, 2e3, 950, "#e8cf7a"},
    {"adipos*", PartKind::soft, 2e3, 950, "#e8cf7a"},
    {"muscle*", PartKind::soft, 2e4, 1060, "#a8453f"},
    {"gluteus", PartKind::soft, 2e4, 1060, "#a8453f"},
    {"iliopsoas", PartKind::soft, 2e4, 1060, "#a8453f"},
    {"psoas", PartKind::soft, 2e4, 1060, "#a8453f"},
    {"autochthon*", PartKind::soft, 2e4, 1060, "#a8453f"},
    {"", PartKind::soft, 1e4, 1000, "#c9a58c"},
};

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  for (const char letter : name)
    if (std::isalpha((unsigned char)letter))
      words.back() += char(std::tolower((unsigned char)letter));
    else if (!words.back().empty())
      words.emplace_back();
  return words;
}

// A word of a name is one of the table, or its plural, or begins with it where that is a beginning.
bool is(const std::string& word, std::string_view wanted) {
  if (wanted.ends_with('*')) return word.starts_with(wanted.substr(0, wanted.size() - 1));
  return word.starts_with(wanted) && (word.size() == wanted.size() || word.substr(wanted.size()) == "s");
}

bool has_all(const std::vector<std::string>& words, std::string_view wanted) {
  while (!wanted.empty()) {
    const std::string_view first = wanted.substr(0, wanted.find(' '));
    if (std::none_of(words.begin(), words.end(), [&](const std::string& word) { return is(word, first); }))
      return false;
    wanted.remove_prefix(std::min(first.size() + 1, wanted.size()));
  }
  return true;
}

}  // namespace

const Anatomy& anatomy_of(std::string_view name) {
  const std::vector<std::string> words = words_of(name);
  return *std::find_if(std::begin(table), std::end(table),
                       [&](const Anatomy& row) { return has_all(words, row.words); });
}

bool is_of_ribcage(std::string_view name) {
  const std::vector<std::string> words = words_of(name);
  return has_all(words, "rib") || has_all(words, "ribcage") || has_all(words, "sternum") ||
         has_all(words, "costal cartilage");
}

}  // namespace limber::scenes
