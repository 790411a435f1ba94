// From finished frames to one thing to look at: a video, a contact sheet.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "render/image.h"

namespace limber::render {

// What make_film would say of these before it looks at any frame: another ending, frames_per_second, no
// folder, no ffmpeg.
void require_film_possible(double frames_per_second, const fs::path& film);

// By the ffmpeg in PATH, as the file's name ends: .mp4, H.264 (yuv420p, BT.709, crf 18); .webm, VP9 (the
// same, crf 30); .gif, 256 colours chosen for the whole, at most 50 frames a second. Every frame is looked at
// first; nothing is written when one is missing or damaged. An odd width or height gets its last column or
// row twice. Same frames, same ffmpeg: same bytes. Throws InputError (another ending; no frames; a bad one,
// which it names; sizes that differ; no ffmpeg; ffmpeg's last words), DiskError, Interrupted.
void make_film(const std::vector<fs::path>& frames, double frames_per_second, const fs::path& film);

struct SheetLook {
  int columns = 0;  // 0: as square as the count allows
  int tile_width_px = 480;
  int margin_px = 16;
  Vec3 background_srgb = {1, 1, 1};
  Vec3 caption_srgb = {0.2, 0.22, 0.25};
};
// Frames in rows, a caption under each (captions: none, or one a frame; cut off where even small letters do
// not fit). Throws InputError when a frame cannot be read or there is none.
Image8 contact_sheet(const std::vector<fs::path>& frames, const std::vector<std::string>& captions,
                     const SheetLook& = {});

// The same of pictures in memory.
Image8 contact_sheet_of(const std::vector<Image8>& frames, const std::vector<std::string>& captions,
                        const SheetLook& = {});

// `count` frames spread evenly over a sequence, first and last among them; all when there are no more.
std::vector<int> spread_over(int frames, int count);

}  // namespace limber::render
