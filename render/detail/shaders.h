// Shader texts; Program puts the version and the defines before them. Light is linear; radiance 1 is what a
// white, matt surface square to the key light sends.
//
// Defines of mesh and depth: PLANES (how many cut it). Of the mesh: TINTED (a colour a vertex and its open
// share of the sky), PAINTED (a color of its own for what is drawn), and with it CORNER_COLORS, IMAGE and
// NORMAL_IMAGE, TRANSLUCENT, GRAINED (has its place at rest), PASSES, FLAT_INSIDE. Of mesh and lines:
// TRANSPARENT (what is drawn goes into lists: layer_lists.h). How samples are read: SAMPLER, INTEGER_SAMPLER,
// SAMPLES (a pixel), FETCH(sampler, pixel, i). How they share lists: SAMPLES_A_LIST; of the sample being
// drawn, LIST (the place of its list) and SAMPLE (its bit there); where a list has four, DEPTH_SAMPLE(i) (the
// sample in whose quarter of the pixel the rasterizer's i-th lies) and DEPTH_PLACE(i) (where that one's depth
// was taken, in pixels from the middle of the pixel).
#pragma once

namespace limber::render::detail {

extern const char* const mesh_vertex_shader;
extern const char* const mesh_fragment_shader;  // shaded, premultiplied
extern const char* const depth_vertex_shader;   // depth only: shadow map
extern const char* const depth_fragment_shader;
extern const char* const line_vertex_shader;  // quads already in clip space
extern const char* const line_fragment_shader;
extern const char* const whole_picture_vertex_shader;  // one triangle over everything
extern const char* const passes_fragment_shader;
extern const char* const layer_lists;             // goes before a text with TRANSPARENT, and this one:
extern const char* const layers_fragment_shader;  // what a list adds up to, front to back

}  // namespace limber::render::detail
