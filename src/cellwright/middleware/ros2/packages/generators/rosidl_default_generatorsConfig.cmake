# The generators that Python needs, in place of all: no C++ interfaces are generated and compiled.
find_package(rosidl_core_generators REQUIRED)
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp:")
set(rosidl_default_generators_FOUND_AMENT_PACKAGE TRUE)
# Eight files at a time: they include the same large headers.
cmake_language(DEFER CALL set_property TARGET ${PROJECT_NAME}__rosidl_typesupport_fastrtps_c PROPERTY UNITY_BUILD ON)
