// What is usual for the parts of a body, by their names. docs/imaging.md has the table and its sources.
#pragma once

#include <string_view>

namespace limber::scenes {

enum class PartKind {
  soft,
  bone,
  hull
};  // a hull is only seen, and seen through: skin, the cage of the ribs

struct Anatomy {
  std::string_view
      words;  // as the table has them: a word, or a beginning ("vertebra*"), or several of one name
  PartKind kind;
  double youngs_modulus_pa, density_kg_m3;  // of soft parts as wholes, at small strain
  const char* color;                        // #rrggbb
};

// The first row of which all words are in the name, whatever its case and its ends (kidneys, vertebrae):
// "lung_upper_lobe_left", "Left kidney", "vertebrae_L5". What no row knows is soft.
const Anatomy& anatomy_of(std::string_view name);

// Of the cage of the ribs: before the organs where one looks from the front.
bool is_of_ribcage(std::string_view name);

}  // namespace limber::scenes
