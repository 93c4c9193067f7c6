# Makes C++ over lanes (common/simd/lanes.h) of the kernels' GLSL: reads ROOT/FILE, writes OUTPUT and, in
# OUTPUT.d, which files it was made of. README.md says which GLSL such a file may use. What is left is included into a
# class (common/kernels/lane_kernel_private.h), in which `float` is a lane each, and line numbers stay those of the GLSL.
cmake_minimum_required(VERSION 3.25)
file(READ ${ROOT}/${FILE} text)
set(text "\n${text}")

# What the class brings along, or the preprocessor.
string(REGEX REPLACE "\n#include \"(shared|lib)/[^\n]*" "\n" text "${text}")
string(REGEX REPLACE "\n#pragma [^\n]*" "\n" text "${text}")
string(REGEX REPLACE "\nlayout\\(local_size_x[^\n]*" "\n" text "${text}")
string(REGEX REPLACE "\n[a-z0-9_]+ [a-z0-9_]+\\([^{};\n]*\\);" "\n" text "${text}")  # declared where it is defined

# The step's block: a struct of vectors that are the same in all lanes.
string(FIND "${text}" "layout(std140" block_begin)
if(NOT block_begin EQUAL -1)
  string(SUBSTRING "${text}" ${block_begin} -1 block)
  string(FIND "${block}" "} u_step;" block_size)
  string(SUBSTRING "${block}" ${block_size} -1 after)
  string(SUBSTRING "${block}" 0 ${block_size} block)
  string(SUBSTRING "${text}" 0 ${block_begin} text)
  string(REGEX REPLACE "layout\\(std140[^\n]*StepBlock {" "struct StepBlock {" block "${block}")
  string(REGEX REPLACE "\n  vec4 " "\n  UniformVec4 " block "${block}")
  string(REGEX REPLACE "\n  uvec4 " "\n  UniformUvec4 " block "${block}")
  string(REGEX REPLACE "\n  float " "\n  number " block "${block}")
  string(REGEX REPLACE "^} u_step;" "};LANE_STEP(StepBlock, u_step)" after "${after}")
  string(APPEND text "${block}${after}")
endif()

# Planes, tables, the scratch and the constants of a model.
string(REGEX REPLACE "layout\\(binding = kUnit([A-Za-z]+)\\) uniform samplerBuffer ([a-z_]+);"
  "samplerBuffer \\2{plane(PlaneRole::\\1)};" text "${text}")
string(REGEX REPLACE "layout\\(binding = kUnit([A-Za-z]+)\\) uniform lookup_table ([a-z_]+);"
  "lookup_table \\2{table(TableRole::\\1)};" text "${text}")
string(REGEX REPLACE "layout\\(std430, binding = kBindingRodScratch\\)[^{]*{([ \n]*)vec4 ([a-z]+)\\[\\];([ \n]*)} ([a-z_]+);"
  "struct {\\1Scratch \\2;\\3} \\4{{scratch_memory()}};" text "${text}")
string(REGEX REPLACE "layout\\(std430, binding = kBinding([A-Za-z]+)\\)[^{]*{([ \n]*)vec4 ([a-z]+)\\[\\];([ \n]*)} ([a-z_]+);"
  "struct {\\2Sheet \\3;\\4} \\5{{plane(PlaneRole::\\1)}};" text "${text}")
string(REGEX REPLACE "\nuniform float ([a-z0-9_]+);" "\nconst number \\1 = constant(\"\\1\");" text "${text}")
string(REGEX REPLACE "\nuniform uint ([a-z0-9_]+);" "\nconst uint \\1 = count(\"\\1\");" text "${text}")

# Constructors of structs, here and in what is included: not every compiler knows C++20's aggregates in parentheses.
set(names "")
set(files "")
set(pending ${FILE})
while(pending)
  list(POP_FRONT pending next)
  set(path ${ROOT}/${next})
  if(NOT EXISTS ${path})  # a test's kernel includes those of this folder
    set(path ${CMAKE_CURRENT_LIST_DIR}/${next})
  endif()
  if(path IN_LIST files)
    continue()
  endif()
  list(APPEND files ${path})
  file(STRINGS ${path} heads REGEX "^struct [A-Za-z]+ {")
  foreach(head IN LISTS heads)
    string(REGEX REPLACE "^struct ([A-Za-z]+) {.*" "\\1" name "${head}")
    list(APPEND names ${name})
  endforeach()
  file(STRINGS ${path} includes REGEX "^#include \"sim/")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"([^\"]*)\".*" "\\1" included "${include}")
    list(APPEND pending ${included})
  endforeach()
endwhile()
list(REMOVE_DUPLICATES names)
foreach(name IN LISTS names)
  string(REGEX REPLACE "([^A-Za-z0-9_])${name}\\(" "\\1CONSTRUCTED(${name})(" text "${text}")
endforeach()

# The language.
string(REGEX REPLACE "\nconst (u?int) (k[A-Za-z]+)" "\nstatic constexpr \\1 \\2" text "${text}")
string(REGEX REPLACE "\nconst float (k[A-Za-z]+)" "\nstatic constexpr number \\1" text "${text}")
string(REGEX REPLACE "([(,\n ])(inout|out) ([A-Za-z0-9_]+) " "\\1\\3& " text "${text}")
string(REGEX REPLACE "\\.xyz([^A-Za-z0-9_(])" ".xyz()\\1" text "${text}")
string(REGEX REPLACE "([^A-Za-z0-9_.])([0-9]+\\.[0-9]+(e[-+]?[0-9]+)?)" "\\1\\2f" text "${text}")
string(REGEX REPLACE "([^A-Za-z0-9_.])([0-9]+e[-+]?[0-9]+)" "\\1\\2f" text "${text}")
string(REPLACE "void main()" "void run_strands()" text "${text}")

string(REGEX REPLACE "^\n" "" text "${text}")
set(guard "")
if(FILE MATCHES "glsl$")
  set(guard "#pragma once\n")
endif()
set(text "${guard}#line 1 \"shaders/${FILE}\"\n${text}")
# What stays the same is not written: nothing has to be compiled again for it.
set(before "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} before)
endif()
if(NOT before STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
list(JOIN files " " files)
file(WRITE ${OUTPUT}.d "${OUTPUT}: ${files}\n")
