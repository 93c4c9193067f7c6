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
  PlyWriter(const ExportOptions& options, const StrandSet& strands)
      : options_(options), strands_(strands), ids_(strands.ids()), groups_(strands.groups()) {}

  Status begin() {
    return options_.is_one_frame ? Status()
                                 : write_file(options_.first_number - 1, "the rest shape",
                                              strands_.rest_points(), strands_.rest_head_points());
  }

  Status write(const ExportFrame& frame) override {
    return write_file(frame.number, fmt::format("at {:.6g} s of the simulation", frame.time_s), frame.points,
                      strands_.head_points(frame.world_from_head));
  }

  Result<WrittenBytes> finish() override { return written_; }

 private:
  /// "out.ply", or of a sequence "out_0001.ply".
  std::filesystem::path path_of(int64_t number) const {
    if (options_.is_one_frame) return options_.path;
    return options_.path.parent_path() / fmt::format("{}_{:04}{}", options_.path.stem().string(), number,
                                                     options_.path.extension().string());
  }

  std::string header(const std::string& moment, size_t head_vertices) const {
    const size_t points = strands_.widths().size() + head_vertices;
    std::string text = fmt::format(
        "ply\nformat binary_little_endian 1.0\n"
        "comment {} strands of {} vertices, root first, {}, in {}\n"
        "comment unit_m {:.7g}\ncomment up_axis {}\n",
        strands_.strand_count(), strands_.vertex_count(), moment,
        options_.space == ExportSpace::Head ? "the head's own space" : "the world", options_.unit_m,
        options_.up == ExportUp::Y ? 'Y' : 'Z');
    if (points == size_t{strands_.strand_count()} * strands_.vertex_count())
      text += fmt::format("comment strand_vertex_count {}\n", strands_.vertex_count());
    text += fmt::format(
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float width\n"
        "element strand {}\nproperty ushort nsegs\nproperty int groom_id\nproperty int groom_group_id\n",
        points, strands_.strand_count());
    if (head_vertices > 0)
      text += fmt::format("element face {}\nproperty list uchar uint vertex_indices\n",
                          strands_.head_triangles().size());
    return text + "end_header\n";
  }

  Status write_file(int64_t number, const std::string& moment, std::span<const glm::dvec3> points,
                    const std::vector<glm::dvec3>& head) {
    std::string bytes = header(moment, head.size());
    const auto put = [&bytes](auto value) {
      char raw[sizeof(value)];
      std::memcpy(raw, &value, sizeof(value));
      bytes.append(raw, sizeof(value));
    };
    const auto put_point = [&](const glm::dvec3& point, float width) {
      for (int axis = 0; axis < 3; ++axis) put(static_cast<float>(point[axis]));
      put(width);
    };
    for (size_t i = 0; i < points.size(); ++i) put_point(points[i], strands_.widths()[i]);
    for (const glm::dvec3& point : head) put_point(point, 0.0f);
    for (size_t strand = 0; strand < strands_.strand_count(); ++strand) {
      put(static_cast<uint16_t>(strands_.vertex_counts()[strand] - 1));
      put(ids_[strand]);
      put(groups_[strand]);
    }
    for (const glm::uvec3& triangle : strands_.head_triangles()) {
      put(uint8_t{3});
      for (int corner = 0; corner < 3; ++corner) put(static_cast<uint32_t>(points.size() + triangle[corner]));
    }
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
  const std::vector<int32_t> ids_, groups_;
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
