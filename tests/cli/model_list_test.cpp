// What a batch is made of: which files, under which names, and what a body's model is besides its bytes.
#include "limber/detail/batch/model_list.h"

#include <set>

#include "core/words.h"
#include "limber/detail/body/model_content.h"
#include "tests/cli/program.h"

namespace limber::detail {
namespace {

class ModelList : public Program {
 protected:
  std::string file(const std::string& name, const std::string& text = "x") const {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << text;
    return (folder / name).string();
  }
  std::string at(const std::string& name) const { return (folder / name).string(); }
  static std::vector<std::string> names(const std::vector<ListedModel>& models) {
    std::vector<std::string> list;
    for (const ListedModel& model : models) list.push_back(model.name);
    return list;
  }
};

TEST_F(ModelList, AFolderGivesItsModelsByTheirPathsAndNothingElse) {
  for (const char* name : {"m/b.obj", "m/a.STL", "m/in/c.ply", "m/readme.md", "m/.hidden/d.obj", "m/.e.obj",
                           "m/out/bodies/a.STL/surface.ply"})
    file(name);
  fs::create_directory_symlink(folder / "m", folder / "m" / "round");
  EXPECT_EQ(names(list_models({at("m")}, {folder / "m" / "out"})),
            (std::vector<std::string>{"a.STL", "b.obj", "in_c.ply"}));
}

TEST_F(ModelList, NoTwoNamesAreOneOnAnyDiskAndNoneDependsOnTheOrder) {
  const std::vector<std::string> words{file("a/x.obj"),
                                       file("b/X.OBJ"),
                                       file("b/y.obj"),
                                       file("c/x.obj"),
                                       file("d/" + std::string(200, 'n') + ".obj"),
                                       file("e/\xff:\n.obj")};
  const std::vector<ListedModel> models = list_models(words, {});
  ASSERT_EQ(models.size(), words.size());
  for (std::size_t i = 0; i < models.size(); ++i) {
    SCOPED_TRACE(models[i].name);
    EXPECT_TRUE(is_utf8(models[i].name));
    EXPECT_LT(models[i].name.size(), 200u);
    EXPECT_EQ(models[i].name.find_first_of("/:\n"), std::string::npos);
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(same_but_for_case(models[i].name, models[j].name));
  }
  EXPECT_EQ(models[2].name, "y.obj");
  std::vector<std::string> backwards = names(list_models({words.rbegin(), words.rend()}, {}));
  std::reverse(backwards.begin(), backwards.end());
  EXPECT_EQ(backwards, names(models));
  EXPECT_EQ(list_models({words[0], words[0], at("a/../a/x.obj")}, {}).size(), 1u);  // one file, once
}

TEST_F(ModelList, AListHasALineOrAPieceBetweenNulsForEachModel) {
  const std::vector<std::string> both{"a.obj", "in/b c.obj"};
  for (const std::string& text : {std::string("a.obj\r\n\n"
                                              "in/b c.obj"),
                                  std::string("a.obj\0in/b c.obj\0", 17)}) {
    std::vector<std::string> files;
    for (const ListedModel& model : list_models({"@" + file("list", text)}, {}))
      files.push_back(model.file.string());
    EXPECT_EQ(files, both);
  }
}

TEST_F(ModelList, WhatStandsForNoModelIsRefused) {
  fs::create_directories(folder / "empty");
  file("text/readme.md");
  for (const std::string& word : {"@" + file("list", "\n\r\n"), "@" + at("no_list"), at("empty"), at("text"),
                                  at("no.obj"), std::string("-")})
    EXPECT_THROW(list_models({word}, {}), InputError) << word;
  EXPECT_EQ(limber_program({"prepare", at("empty"), "-o", out()}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"prepare", file("a.obj"), at("no.obj"), "-o", out()}).code, exit_bad_input);
  EXPECT_FALSE(fs::exists(out()));
  EXPECT_THROW(list_models({folder.path().string()}, {folder.path()}), InputError);  // its own results
}

TEST_F(ModelList, OptionsOfManyAreRefusedForOneAndOfOneForMany) {
  const std::string model = file("a.obj");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--jobs", "2"},
                                               {"--time-limit", "5"},
                                               {"--memory-limit", "1GB"},
                                               {"--retry-failed"}}) {
    std::vector<std::string> words{"prepare", model, "-o", out()};
    words.insert(words.end(), more.begin(), more.end());
    const Result run = limber_program(words);
    EXPECT_EQ(run.code, exit_bad_input) << more[0];
    EXPECT_NE(run.err.find("of many models"), std::string::npos) << run.err;
  }
  EXPECT_EQ(limber_program({"prepare", model, model, "-o", out(), "--format", "stl"}).code, exit_bad_input);
  EXPECT_EQ(limber_program({"prepare", model, "-o", out(), "--only", "cage", "--preview"}).code,
            exit_bad_input);
  EXPECT_EQ(
      limber_program({"prepare", model, model, "-o", out(), "--only", "shells", "--mode", "paper"}).code,
      exit_bad_input);
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(ModelList, AModelIsItsBytesAndThoseOfTheFilesThatItNames) {
  const std::string model =
      file("m/x.gltf", R"({"buffers":[{"uri":"my%20part.bin"},{"uri":"in\\b.bin"}], "v": [0.5, 1.e5]})");
  const ModelContent alone = content_of_model(model);
  file("m/other.bin");  // not named
  EXPECT_EQ(content_of_model(model).content, alone.content);
  std::set<std::string> seen{alone.content};
  const auto is_new = [&] { return seen.insert(content_of_model(model).content).second; };
  file("m/my part.bin", "1");
  EXPECT_TRUE(is_new());  // it was missing
  file("m/my part.bin", "2");
  EXPECT_TRUE(is_new());
  file("m/in/b.bin", "1");
  EXPECT_TRUE(is_new());
  EXPECT_NE(content_of_model(model).file_hash, alone.file_hash);
  EXPECT_EQ(files_named_in(read_file(model), model).size(), 2u);
}

TEST_F(ModelList, AnObjIsItsMaterialsAndTheirImagesToo) {
  const std::string model = file("m/x.obj", "mtllib my.mtl\nusemtl a\n");
  std::set<std::string> seen{content_of_model(model).content};
  const auto is_new = [&] { return seen.insert(content_of_model(model).content).second; };
  file("m/skin.png", "1");
  EXPECT_FALSE(is_new()) << "nothing names it";
  file("m/my.mtl", "newmtl a\nmap_Kd -clamp on C:\\work\\skin.png\n");
  EXPECT_TRUE(is_new());
  file("m/skin.png", "2");
  EXPECT_TRUE(is_new());
  fs::remove(folder / "m/skin.png");
  EXPECT_TRUE(is_new());
  file("m/other.png", "1");
  EXPECT_FALSE(is_new());
}

}  // namespace
}  // namespace limber::detail
