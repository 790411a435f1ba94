// A linked pair of shaders. GL's own types stay out of headers: a GLuint is an unsigned int.
#pragma once

#include <map>
#include <string>

#include "core/types.h"

namespace limber::render::detail {

class Program {
 public:
  // defines: lines put before both texts. FRAGMENT is defined in one of them. The programs live as long as
  // their context.
  Program(const char* vertex, const char* fragment, const std::string& defines = "");
  void use() const;
  // The uniform of this name; one that the shaders do not use is passed over.
  void set(const char* name, int) const;
  void set(const char* name, double) const;
  void set(const char* name, const Eigen::Vector2d&) const;
  void set(const char* name, const Vec3&) const;
  void set(const char* name, const Eigen::Vector4d&) const;
  void set(const char* name, const Eigen::Matrix3d&) const;
  void set(const char* name, const Eigen::Matrix4d&) const;

 private:
  int at(const char* name) const;
  unsigned id_;
};

// One pair of shader texts, compiled for each set of defines when it is first asked for.
class Variants {
 public:
  Variants(const char* vertex, const char* fragment) : vertex_(vertex), fragment_(fragment) {}
  const Program& with(const std::string& defines);

 private:
  const char *vertex_, *fragment_;
  std::map<std::string, Program> programs_;
};

}  // namespace limber::render::detail
