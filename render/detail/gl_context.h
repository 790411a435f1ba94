// The only place that knows where OpenGL comes from: OSMesa, in memory, without a window system. Mesa 25.1
// dropped OSMesa; an EGL surfaceless context would take its place here.
#pragma once

namespace limber::render::detail {

class GlContext {
 public:
  GlContext();  // OpenGL 3.3 core; throws InputError when the library refuses
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  void make_current();  // for the calling thread; cheap when it already is

 private:
  void* context_;
  unsigned char
      unused_pixels_[4 * 16 * 16];  // OSMesa insists on a buffer; all drawing goes to framebuffer objects
};

}  // namespace limber::render::detail
