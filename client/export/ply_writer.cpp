// PLY in binary: a file for each frame, of points and of how many segments each strand has.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include "client/export/strand_writer.h"
#include "common/base/output_file.h"

namespace strandcast {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

class PlyWriter : public StrandWriter {
 public:
  PlyWriter(const ExportOptions& options, const StrandSet& strands) : options_(options), strands_(strands) {}

  Status begin() {
    return options_.is_one_frame ? Status() : write_file(0, "the rest shape", strands_.rest_points());
  }

  Status write(const ExportFrame& frame) override {
    return write_file(frame.number, fmt::format("at {:.6g} s of the simulation", frame.time_s), frame.points);
  }

  Result<WrittenBytes> finish() override { return written_; }

 private:
  /// "out.ply", or of a sequence "out_0001.ply".
  std::filesystem::path path_of(uint64_t number) const {
    if (options_.is_one_frame) return options_.path;
    return options_.path.parent_path() / fmt::format("{}_{:04}{}", options_.path.stem().string(), number,
                                                     options_.path.extension().string());
  }

  std::string header(const std::string& moment) const {
    const uint64_t points = uint64_t{strands_.strand_count()} * strands_.vertex_count();
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\n"
        "comment {} strands of {} vertices, root first, {}, in {}\n"
        "comment unit_m {}\ncomment up_axis {}\ncomment strand_vertex_count {}\n"
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float width\n"
        "element strand {}\nproperty ushort nsegs\nend_header\n",
        strands_.strand_count(), strands_.vertex_count(), moment,
        options_.space == ExportSpace::Head ? "the head's own space" : "the world", metres_of(options_.unit),
        options_.up == ExportUp::Y ? 'Y' : 'Z', strands_.vertex_count(), points, strands_.strand_count());
  }

  Status write_file(uint64_t number, const std::string& moment, std::span<const glm::dvec3> points) {
    std::string bytes = header(moment);
    const auto put = [&bytes](auto value) {
      char raw[sizeof(value)];
      std::memcpy(raw, &value, sizeof(value));
      bytes.append(raw, sizeof(value));
    };
    for (size_t i = 0; i < points.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) put(static_cast<float>(points[i][axis]));
      put(strands_.widths()[i % strands_.vertex_count()]);
    }
    for (uint32_t strand = 0; strand < strands_.strand_count(); ++strand)
      put(static_cast<uint16_t>(strands_.vertex_count() - 1));
    written_.last_path = path_of(number);
    ASSIGN_OR_RETURN(OutputFile file, OutputFile::create(written_.last_path));
    RETURN_IF_ERROR(file.append(bytes));
    RETURN_IF_ERROR(file.finish());
    ++written_.files;
    written_.bytes += bytes.size();
    return {};
  }

  const ExportOptions options_;
  const StrandSet& strands_;
  WrittenBytes written_;
};

}  // namespace

Result<std::unique_ptr<StrandWriter>> make_ply_writer(const ExportOptions& options,
                                                      const StrandSet& strands) {
  auto writer = std::make_unique<PlyWriter>(options, strands);
  RETURN_IF_ERROR(writer->begin());
  return std::unique_ptr<StrandWriter>(std::move(writer));
}

}  // namespace strandcast
