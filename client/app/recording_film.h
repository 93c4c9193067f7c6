// A recording as pictures or a film, without a window: drawn frame by frame by the renderer of viewers.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "client/app/view_options.h"
#include "common/base/result.h"

namespace strandcast {

/// Frames of a film or pictures at most.
inline constexpr uint64_t kMostFilmFrames = 1'000'000;

/// Whether this can be exported to: a .webm or .webp, or PNGs with a number in their name ("%04d"). BadInput
/// says what can.
Status check_film_path(const std::filesystem::path& path);

/// The path of picture `number` of a name with "%d" or "%04d" in it.
std::filesystem::path numbered_path(const std::filesystem::path& pattern, uint64_t number);

/// Draws options.recording into options.film; a sentence of what was made. After a stop a film is as long as
/// it was by then.
Result<std::string> run_film(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
