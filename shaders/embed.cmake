# Writes OUTPUT, a C++ file with the text of every shader. ROOT is shaders/, FILES a comma-separated list below it.
string(REPLACE "," ";" files "${FILES}")
set(rows "")
foreach(file IN LISTS files)
  file(READ "${ROOT}/${file}" text)
  string(APPEND rows "    {\"${file}\", R\"shader(${text})shader\"},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Generated from shaders/ by embed.cmake.
#include \"common/gl/embedded_shaders.h\"

namespace strandcast::gl {

std::span<const EmbeddedShader> embedded_shaders() {
  static const EmbeddedShader shaders[] = {
${rows}  };
  return shaders;
}

}  // namespace strandcast::gl
")
