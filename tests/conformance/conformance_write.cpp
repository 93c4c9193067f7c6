// Keeps what today's encoders make: conformance_write FOLDER (tests/conformance/vectors). Writes the files
// that are not there yet; one that is there is never written again, whatever today's encoders would make of
// it.
#include <fmt/format.h>

#include "common/base/file.h"
#include "tests/conformance/control_vectors.h"
#include "tests/conformance/payload_vectors.h"

namespace strandcast::conformance {
namespace {

/// False when there is such a file with another content, which stays.
bool keep(const std::filesystem::path& path, const std::string& text) {
  if (!std::filesystem::exists(path)) {
    const auto saved = save_file(path, std::as_bytes(std::span(text)));
    fmt::print("{}: {}\n", path.string(), saved ? "written" : saved.error().to_string());
    return saved.ok();
  }
  const auto old_text = load_text(path, 1u << 20);
  if (old_text && *old_text == text) return true;
  fmt::print(stderr, "{}: is there with another content and stays; what is new needs a number of its own\n",
             path.string());
  return false;
}

/// Messages with fields that no kept message has, in a file of their own.
bool keep_messages(const std::filesystem::path& folder) {
  const auto known = load_messages(folder);
  if (!known) {
    fmt::print(stderr, "{}\n", known.error().to_string());
    return false;
  }
  std::string text;
  for (const StoredMessage& message : new_messages(*known))
    text += fmt::format("{} {} {}\n", message.is_client ? "client" : "server", to_hex(message.bytes),
                        message.text);
  if (text.empty()) return true;
  int number = 1;
  const auto path = [&] { return folder / fmt::format("control_v1_{}.txt", number); };
  while (std::filesystem::exists(path())) ++number;
  return keep(path(), text);
}

int run(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  bool is_kept = true;
  for (const StreamCase& stream : stream_cases()) {
    const StoredStream made = make_stream(stream);
    is_kept &= keep(folder / file_name_of(made), to_text(made));
  }
  is_kept &= keep_messages(folder);
  is_kept &= keep(folder / "asset_1.txt", make_asset_lines(AssetLayout::Floats));
  is_kept &= keep(folder / "asset_2.txt", make_asset_lines(AssetLayout::Numbers));
  is_kept &= keep(folder / "asset_3.txt", make_asset_lines(AssetLayout::Form));
  is_kept &= keep(folder / "tiles.txt", make_tile_lines());
  return is_kept ? 0 : 1;
}

}  // namespace
}  // namespace strandcast::conformance

int main(int argument_count, char** arguments) {
  if (argument_count != 2) {
    fmt::print(stderr, "usage: conformance_write FOLDER (tests/conformance/vectors)\n");
    return 2;
  }
  return strandcast::conformance::run(arguments[1]);
}
