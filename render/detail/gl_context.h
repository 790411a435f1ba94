// The only place that knows where OpenGL comes from: three functions, by OSMesa (gl_context_osmesa.cpp) or,
// with the CMake option LIMBER_EGL, by EGL without a surface (gl_context_egl.cpp), as Mesa 25.1 dropped
// OSMesa. Neither needs a window system.
#pragma once

#include <memory>

namespace limber::render::detail {

class GlContext {
 public:
  GlContext();  // OpenGL 4.4 core, current; throws InputError when the library refuses
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  void make_current();  // in the thread that made it; cheap when it already is

 private:
  struct Backend;
  std::unique_ptr<Backend> backend_;
};

}  // namespace limber::render::detail
