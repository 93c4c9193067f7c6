#include <google/protobuf/descriptor.h>

#include <algorithm>

#include "common/scene/scene_override.h"
#include "common/scene/text_errors_private.h"

namespace strandcast {

std::string place_at(const std::string& place, int line, int column) {
  return fmt::format("{}:{}:{}", place, line + 1, column + 1);
}

void TextErrors::AddError(int line, int column, const std::string& message) {
  if (has_error_) return;
  has_error_ = true;
  line_ = std::max(line, 0);
  column_ = std::max(column, 0);
  message_ = message;
}

Error TextErrors::error(const std::string& place) const {
  return at(place_at(place, line_, column_), make_error(ErrorCode::BadInput, "{}{}", message_, known()));
}

std::string TextErrors::known() const {
  constexpr std::string_view kBegin = "Message type \"";
  const size_t end = message_.find("\" has no field");
  if (!message_.starts_with(kBegin) || end == std::string::npos) return {};
  const auto* type = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(
      message_.substr(kBegin.size(), end - kBegin.size()));
  return type ? fmt::format(" ({})", known_fields(*type)) : std::string{};
}

}  // namespace strandcast
