#include "render/detail/gl_context.h"

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <cstdlib>

#include "core/error.h"

namespace limber::render::detail {

namespace {

[[noreturn]] void refuse(const char* what) {
  throw InputError(
      fmt::format("EGL {} (error {:#x}); is libegl-mesa0 installed? Without a display, Mesa's software "
                  "driver is asked for",
                  what, eglGetError()));
}

// One for the process. As gl_context_osmesa.cpp says of llvmpipe; and its pixels, not those of whatever card
// is there, unless the user says LIBGL_ALWAYS_SOFTWARE=0.
EGLDisplay display() {
  static const EGLDisplay shared = [] {
    ::unsetenv("LP_NATIVE_VECTOR_WIDTH");
    ::setenv("LP_NUM_THREADS", "0", 0);
    ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 0);
    const EGLDisplay d = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (d == EGL_NO_DISPLAY || !eglInitialize(d, nullptr, nullptr))
      refuse("gives no display without a surface");
    return d;
  }();
  return shared;
}

}  // namespace

struct GlContext::Backend {
  EGLContext context;
};

GlContext::GlContext() : backend_(std::make_unique<Backend>()) {
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                               4,
                               EGL_CONTEXT_MINOR_VERSION,
                               4,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  if (!eglBindAPI(EGL_OPENGL_API)) refuse("has no OpenGL");
  backend_->context = eglCreateContext(display(), EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (backend_->context == EGL_NO_CONTEXT) refuse("gives no OpenGL 4.4 context");
  make_current();
}

GlContext::~GlContext() {
  if (eglGetCurrentContext() == backend_->context)
    eglMakeCurrent(display(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display(), backend_->context);
}

void GlContext::make_current() {
  if (eglGetCurrentContext() == backend_->context) return;
  if (!eglMakeCurrent(display(), EGL_NO_SURFACE, EGL_NO_SURFACE, backend_->context))
    refuse("refuses to make its context current");
}

}  // namespace limber::render::detail
