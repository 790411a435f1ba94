// What a JSON file of ours holds, checked once where it is read: nobody after that meets a text where a
// number belongs.
#pragma once

#include "core/json.h"

namespace limber {

enum class Keys { all, those_there };  // of the example: must they be there?

// Throws InputError "WHAT: KEY.KEY is …, where … belongs; REMEDY" where the value is not like the example: of
// another kind, or, for a table, without one of its keys. Lists are like the example's first element, all of
// them; of an empty table or list nothing is asked. A number may be whole or not where the example's is not
// whole; a whole one lies within 32 bits where the example's is negative (−1), else within 64.
void require_like(const Json& value, const Json& example, Keys, const std::string& what,
                  const std::string& remedy);

}  // namespace limber
