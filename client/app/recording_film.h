// Exports a recording as pictures or a film without a window, drawn frame by frame by the viewers' renderer.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "client/app/view_options.h"
#include "common/base/result.h"

namespace strandcast {

/// Largest number of frames of a film, or of pictures.
inline constexpr uint64_t kMostFilmFrames = 1'000'000;

/// Checks the export path: a .webm or .webp file, or PNGs with a number in their name ("%04d"). BadInput says
/// what is possible.
Status check_film_path(const std::filesystem::path& path);

/// Returns the path of picture `number` for a name with "%d" or "%04d".
std::filesystem::path numbered_path(const std::filesystem::path& pattern, uint64_t number);

/// Draws options.recording into options.film and returns a sentence about the result. If stopped, the film
/// ends there.
Result<std::string> run_film(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
