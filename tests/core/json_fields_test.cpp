// What is read into a struct is what was written from it, and what is wrong is named.
#include "core/json_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace limber {
namespace {

struct Part {
  std::string name;
  double share = 0;
  bool operator==(const Part&) const = default;
  template <class Fields>
  void fields(Fields& f) {
    f("name", name), f("share", share);
  }
};

struct Document {
  int count = 0;
  std::uint64_t seed = 0;
  std::optional<double> limit_s;
  std::optional<Part> best;
  std::vector<Part> parts;
  std::array<int, 2> size{};
  std::map<std::string, bool> holds;
  InOrder<double> costs;
  fs::path folder;
  int tries = 1;
  bool operator==(const Document&) const = default;
  template <class Fields>
  void fields(Fields& f) {
    f.within("count", count, 0, 9), f("seed", seed), f("limit_s", limit_s), f.if_there("best", best);
    f("parts", parts), f("size", size), f("holds", holds), f("costs", costs), f("folder", folder);
    f.unless_usual("tries", tries, 1);
  }
};

const Document full{9,
                    ~std::uint64_t(0),
                    0.5,
                    Part{"a", 1},
                    {{"b", 0.25}, {"c", -2}},
                    {3, 4},
                    {{"x", true}},
                    {{"z", 1}, {"a", 2}},
                    "there",
                    2};

std::string complaint(const std::string& pointer, const Json& value) {
  Json json = json_of_fields(full);
  json[Json::json_pointer(pointer)] = value;
  try {
    read_fields<Document>(json, "file", "remove it");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(JsonFields, WhatIsWrittenIsReadBack) {
  EXPECT_EQ(read_fields<Document>(json_of_fields(full), "file", ""), full);
  const Document bare = read_fields<Document>(json_of_fields(Document{}), "file", "");
  EXPECT_EQ(bare, Document{});
}

TEST(JsonFields, KeysAreInTheOrderOfTheFields) {
  EXPECT_EQ(
      json_of_fields(Document{}).dump(),
      R"({"count":0,"seed":0,"limit_s":null,"parts":[],"size":[0,0],"holds":{},"costs":{},"folder":""})");
}

TEST(JsonFields, AMapMayKeepTheOrderOfItsFile) {
  EXPECT_EQ(json_of_fields(full)["costs"].dump(), R"({"z":1.0,"a":2.0})");
}

TEST(JsonFields, WhatIsWrongIsNamed) {
  EXPECT_EQ(complaint("/parts/1/share", "much"),
            "file: parts[1].share is a text, where a number belongs; remove it");
  EXPECT_EQ(complaint("/count", 1.5),
            "file: count is a number, where a whole number of common size belongs; "
            "remove it");
  EXPECT_EQ(complaint("/count", 10), "file: count is 10; it must be in [0, 9]; remove it");
  EXPECT_EQ(complaint("/seed", -1),
            "file: seed is a whole number, where a whole number of common size belongs; remove it");
  EXPECT_EQ(complaint("/tries", std::int64_t(1) << 40),
            "file: tries is a whole number, where a whole number of common size belongs; remove it");
  EXPECT_EQ(complaint("/size", Json::array({1})),
            "file: size is a list, where a list of another length belongs; remove it");
  EXPECT_EQ(complaint("/holds/x", nullptr),
            "file: holds.x is nothing, where true or false belongs; remove it");
  EXPECT_EQ(complaint("/folder", Json::object()), "file: folder is a table, where a text belongs; remove it");
  EXPECT_EQ(complaint("/parts", 1), "file: parts is a whole number, where a list belongs; remove it");
}

TEST(JsonFields, AMissingKeyIsNamedUnlessItMayBe) {
  for (const char* key : {"count", "seed", "parts", "size", "holds", "costs", "folder"}) {
    Json json = json_of_fields(full);
    json.erase(key);
    EXPECT_FALSE(fields_or_nothing<Document>(json)) << key;
    EXPECT_THAT([&] { read_fields<Document>(json, "file", "remove it"); },
                testing::ThrowsMessage<InputError>(std::string("file: ") + key + " is missing; remove it"));
  }
  Json json = json_of_fields(full);
  for (const char* key : {"limit_s", "best", "tries"}) json.erase(key);
  const Document bare = read_fields<Document>(json, "file", "");
  EXPECT_FALSE(bare.limit_s || bare.best);
  EXPECT_EQ(bare.tries, 1);
}

}  // namespace
}  // namespace limber
