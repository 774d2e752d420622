# SPDX-License-Identifier: Apache-2.0
# Every dependency is a Debian package (scripts/packages.txt) and stays behind one of these targets, as SYSTEM headers. They are
# IMPORTED, as what they stand for is: static libraries of ours name them, and the configuration of the package includes this file
# for those that link such.
find_package(glm REQUIRED)
find_package(Threads REQUIRED)

# PALPATE_EMBREE: the version that a static library was built with. Else the one that there is.
find_package(embree ${PALPATE_EMBREE} REQUIRED)
string(REGEX MATCH "^[0-9]+" PALPATE_EMBREE "${embree_VERSION}")
if(NOT PALPATE_EMBREE MATCHES "^[34]$")
  message(FATAL_ERROR "Embree ${embree_VERSION} in ${embree_DIR}: Palpate needs Embree 3 or 4; set embree_DIR to one of these")
endif()
add_library(palpate_embree INTERFACE IMPORTED)
target_link_libraries(palpate_embree INTERFACE embree)

find_package(TBB REQUIRED)
find_path(PALPATE_OPENVDB_INCLUDE openvdb/openvdb.h REQUIRED)
find_library(PALPATE_OPENVDB_LIBRARY openvdb REQUIRED)
# OpenVDB's headers use its table of halves where the compiler has no instructions for them (F16C).
find_library(PALPATE_IMATH_LIBRARY Imath REQUIRED)
add_library(palpate_openvdb INTERFACE IMPORTED)
target_include_directories(palpate_openvdb SYSTEM INTERFACE ${PALPATE_OPENVDB_INCLUDE})
target_link_libraries(palpate_openvdb INTERFACE ${PALPATE_OPENVDB_LIBRARY} ${PALPATE_IMATH_LIBRARY} TBB::tbb)

# Writing NRRD and NIfTI, the Gaussian and connected components. ITK's own use file sets directory-wide flags, so its variables are used.
find_package(ITK 5 REQUIRED COMPONENTS ITKCommon ITKIOImageBase ITKIONRRD ITKIONIFTI ITKSmoothing ITKConnectedComponents)
add_library(palpate_itk INTERFACE IMPORTED)
target_include_directories(palpate_itk SYSTEM INTERFACE ${ITK_INCLUDE_DIRS})
target_link_libraries(palpate_itk INTERFACE ${ITK_LIBRARIES})

# Decoding compressed DICOM pixels. Its own configuration drags in what is not needed.
find_path(PALPATE_GDCM_INCLUDE gdcmBitmap.h PATH_SUFFIXES gdcm-3.0 REQUIRED)
add_library(palpate_gdcm INTERFACE IMPORTED)
target_include_directories(palpate_gdcm SYSTEM INTERFACE ${PALPATE_GDCM_INCLUDE})
foreach(library gdcmMSFF gdcmDSED gdcmCommon)
  find_library(PALPATE_${library} ${library} REQUIRED)
  target_link_libraries(palpate_gdcm INTERFACE ${PALPATE_${library}})
endforeach()

find_package(ZLIB REQUIRED)
add_library(palpate_zlib INTERFACE IMPORTED)
target_link_libraries(palpate_zlib INTERFACE ZLIB::ZLIB)

find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
add_library(palpate_text INTERFACE IMPORTED)
target_link_libraries(palpate_text INTERFACE fmt::fmt nlohmann_json::nlohmann_json tomlplusplus::tomlplusplus Threads::Threads)

find_package(HDF5 REQUIRED COMPONENTS C)
add_library(palpate_hdf5 INTERFACE IMPORTED)
target_include_directories(palpate_hdf5 SYSTEM INTERFACE ${HDF5_C_INCLUDE_DIRS})
target_link_libraries(palpate_hdf5 INTERFACE ${HDF5_C_LIBRARIES})

find_package(OpenSSL REQUIRED COMPONENTS Crypto)
add_library(palpate_hash INTERFACE IMPORTED)
target_link_libraries(palpate_hash INTERFACE OpenSSL::Crypto)

find_package(PNG REQUIRED)
add_library(palpate_png INTERFACE IMPORTED)
target_link_libraries(palpate_png INTERFACE PNG::PNG)

# Beast and Asio: headers alone. Boost's own search would look for compiled libraries.
find_path(PALPATE_BOOST_INCLUDE boost/beast.hpp REQUIRED)
add_library(palpate_boost INTERFACE IMPORTED)
target_include_directories(palpate_boost SYSTEM INTERFACE ${PALPATE_BOOST_INCLUDE})
target_link_libraries(palpate_boost INTERFACE Threads::Threads)

# Its hidraw side alone: the libusb side takes devices away from the kernel and drops the wrong reports.
find_path(PALPATE_HIDAPI_INCLUDE hidapi/hidapi.h REQUIRED)
find_library(PALPATE_HIDAPI_LIBRARY hidapi-hidraw REQUIRED)
add_library(palpate_hidapi INTERFACE IMPORTED)
target_include_directories(palpate_hidapi SYSTEM INTERFACE ${PALPATE_HIDAPI_INCLUDE})
target_link_libraries(palpate_hidapi INTERFACE ${PALPATE_HIDAPI_LIBRARY})

if(PALPATE_WITH_CGAL)
  # It makes a cache entry BUILD_TESTING=OFF where there is none: it would turn off the tests of a host.
  set(palpate_build_testing_before "${BUILD_TESTING}")
  find_package(CGAL REQUIRED)
  if(palpate_build_testing_before STREQUAL "")
    unset(BUILD_TESTING CACHE)
  endif()
  add_library(palpate_cgal INTERFACE IMPORTED)
  target_link_libraries(palpate_cgal INTERFACE CGAL::CGAL)
endif()
