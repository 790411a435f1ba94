#include "render/detail/program.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include "core/error.h"

namespace limber::render::detail {

Program::Program(const char* vertex, const char* fragment, const std::string& defines)
    : id_(glCreateProgram()) {
  for (const auto& [kind, text] :
       {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
    const GLuint shader = glCreateShader(GLenum(kind));
    const char* texts[] = {"#version 430 core\n#extension GL_ARB_derivative_control : require\n",
                           kind == GL_VERTEX_SHADER ? "" : "#define FRAGMENT\n", defines.c_str(), text};
    glShaderSource(shader, 4, texts, nullptr);
    glCompileShader(shader);
    GLint compiled = 0;
    char log[2000] = "";
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    glGetShaderInfoLog(shader, sizeof log, nullptr, log);
    LIMBER_CHECK(compiled, defines, log);
    glAttachShader(id_, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(id_);
  GLint linked = 0;
  glGetProgramiv(id_, GL_LINK_STATUS, &linked);
  char log[2000] = "";
  glGetProgramInfoLog(id_, sizeof log, nullptr, log);
  LIMBER_CHECK(linked, defines, log);
}

void Program::use() const { glUseProgram(id_); }
int Program::at(const char* name) const { return glGetUniformLocation(id_, name); }

void Program::set(const char* name, int v) const { glUniform1i(at(name), v); }
void Program::set(const char* name, double v) const { glUniform1f(at(name), float(v)); }
void Program::set(const char* name, const Eigen::Vector2d& v) const {
  glUniform2f(at(name), float(v.x()), float(v.y()));
}
void Program::set(const char* name, const Vec3& v) const {
  glUniform3f(at(name), float(v.x()), float(v.y()), float(v.z()));
}
void Program::set(const char* name, const Eigen::Vector4d& v) const {
  glUniform4f(at(name), float(v[0]), float(v[1]), float(v[2]), float(v[3]));
}
void Program::set(const char* name, const Eigen::Matrix3d& m) const {
  glUniformMatrix3fv(at(name), 1, GL_FALSE, Eigen::Matrix3f(m.cast<float>()).data());
}
void Program::set(const char* name, const Eigen::Matrix4d& m) const {
  glUniformMatrix4fv(at(name), 1, GL_FALSE, Eigen::Matrix4f(m.cast<float>()).data());
}

const Program& Variants::with(const std::string& defines) {
  const auto found = programs_.find(defines);
  return found != programs_.end()
             ? found->second
             : programs_.emplace(defines, Program(vertex_, fragment_, defines)).first->second;
}

}  // namespace limber::render::detail
