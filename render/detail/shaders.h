// GLSL 3.30. Light is linear; radiance 1 is what a white, matt surface square to the key light sends.
#pragma once

namespace limber::render::detail {

extern const char* const mesh_vertex_shader;
extern const char* const mesh_fragment_shader;  // shaded, premultiplied
extern const char* const shadow_vertex_shader;  // depth only, from the key light
extern const char* const shadow_fragment_shader;
extern const char* const line_vertex_shader;  // quads already in clip space
extern const char* const line_fragment_shader;
extern const char* const picture_vertex_shader;    // one triangle over everything
extern const char* const picture_fragment_shader;  // averages the samples over background and ground

}  // namespace limber::render::detail
