// CSV: a row for each vertex of each frame.
#include <fmt/format.h>

#include <string>
#include <utility>

#include "client/export/number_text.h"
#include "client/export/strand_writer.h"
#include "common/base/output_file.h"

namespace strandcast {
namespace {

constexpr int kTimeDecimals = 6;
constexpr size_t kMostRowChars = 8 * kMostDecimalChars;

class CsvWriter : public StrandWriter {
 public:
  CsvWriter(const ExportOptions& options, const StrandSet& strands, OutputFile file)
      : decimals_(export_decimals(options.unit_m)),
        first_number_(options.first_number),
        path_(options.path),
        strands_(strands),
        file_(std::move(file)) {
    unit_ = options.unit_m == 0.01 ? "cm" : options.unit_m == 1.0 ? "m" : "units";
  }

  Status begin() {
    RETURN_IF_ERROR(
        file_.append(fmt::format("frame,time_s,strand,vertex,x_{0},y_{0},z_{0},width_{0}\n", unit_)));
    return append_rows(fmt::format("{},,", first_number_ - 1), strands_.rest_points());
  }

  Status write(const ExportFrame& frame) override {
    char digits[kMostDecimalChars];
    const std::string time(digits, put_decimal(digits, frame.time_s, kTimeDecimals));
    return append_rows(fmt::format("{},{},", frame.number, time), frame.points);
  }

  Result<WrittenBytes> finish() override {
    const uint64_t bytes = file_.size_bytes();
    RETURN_IF_ERROR(file_.finish());
    return WrittenBytes{1, bytes, path_};
  }

 private:
  Status append_rows(const std::string& begin, std::span<const glm::dvec3> points) {
    rows_.resize(points.size() * (begin.size() + kMostRowChars));
    char* out = rows_.data();
    const auto put = [&out](std::string_view text) { out = std::copy(text.begin(), text.end(), out); };
    size_t i = 0;
    for (size_t strand = 0; strand < strands_.strand_count(); ++strand) {
      for (uint32_t vertex = 0; vertex < strands_.vertex_counts()[strand]; ++vertex, ++i) {
        put(begin);
        out = std::to_chars(out, out + kMostDecimalChars, strand).ptr;
        *out++ = ',';
        out = std::to_chars(out, out + kMostDecimalChars, vertex).ptr;
        for (int axis = 0; axis < 3; ++axis) {
          *out++ = ',';
          out = put_decimal(out, points[i][axis], decimals_);
        }
        *out++ = ',';
        out = fmt::format_to(out, "{:.6g}", strands_.widths()[i]);
        *out++ = '\n';
      }
    }
    return file_.append({rows_.data(), static_cast<size_t>(out - rows_.data())});
  }

  const int decimals_;
  const int64_t first_number_;
  const std::filesystem::path path_;
  std::string unit_;
  const StrandSet& strands_;
  OutputFile file_;
  std::string rows_;  // of one frame
};

}  // namespace

Result<std::unique_ptr<StrandWriter>> make_csv_writer(const ExportOptions& options,
                                                      const StrandSet& strands) {
  ASSIGN_OR_RETURN(OutputFile file, OutputFile::create(options.path));
  auto writer = std::make_unique<CsvWriter>(options, strands, std::move(file));
  RETURN_IF_ERROR(writer->begin());
  return std::unique_ptr<StrandWriter>(std::move(writer));
}

}  // namespace strandcast
