// strandcast-ctl bundle: makes one HTML file of a recording or of a scene, which browsers play without a
// server: the page with its modules, the asset, strands and looks. A scene is recorded first.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/app/scenario/scene_recording.h"
#include "common/base/result.h"
#include "common/page/page_files.h"
#include "common/record/recording_reader.h"

namespace CLI {
class App;
}

namespace strandcast {

struct BundleCommand {
  std::vector<std::filesystem::path> paths;  // [recording, scene or hair], the HTML file
  std::optional<double> seconds;             // of the recording, from its begin; all of it if absent
  SceneRecordingOptions scene;               // how a scene is recorded; `paths` and `seconds` go before
  bool has_all_solvers = false;              // with the module that steps every solver, which is larger
};

/// Largest number of bytes of recorded frames in a bundle.
inline constexpr size_t kMaxBundleTapeBytes = size_t{128} << 20;

void declare_bundle(CLI::App& app, BundleCommand& command);

struct Bundle {
  std::string html;
  uint64_t frame_count = 0;
  double seconds = 0.0;     // of simulation
  size_t tape_bytes = 0;    // asset and frames
  uint64_t damaged = 0;     // parts of the recording that could not be read
  std::string other_codec;  // that the recording goes on with behind the bundle; empty: none
};
/// Makes the bundle of what the reader gives; it must have been opened for all parts. BadInput
/// without frames, Unsupported without `files`, LimitExceeded beyond kMaxBundleTapeBytes.
Result<Bundle> make_bundle(RecordingReader& reader, PageFiles files, const BundleCommand& command);

int run_bundle(const BundleCommand& command, const std::atomic<bool>& stop);

}  // namespace strandcast
