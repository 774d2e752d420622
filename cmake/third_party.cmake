# SPDX-License-Identifier: Apache-2.0
# Every dependency is a Debian package (scripts/packages.txt) and stays behind one of these targets, as SYSTEM headers.
find_package(glm REQUIRED)
find_package(Threads REQUIRED)

find_package(embree 3 REQUIRED)
add_library(palpate_embree INTERFACE)
target_link_libraries(palpate_embree INTERFACE embree)

find_package(TBB REQUIRED)
find_path(OPENVDB_INCLUDE openvdb/openvdb.h REQUIRED)
find_library(OPENVDB_LIBRARY openvdb REQUIRED)
add_library(palpate_openvdb INTERFACE)
target_include_directories(palpate_openvdb SYSTEM INTERFACE ${OPENVDB_INCLUDE})
target_link_libraries(palpate_openvdb INTERFACE ${OPENVDB_LIBRARY} TBB::tbb)

# Writing NRRD and NIfTI, the Gaussian and connected components. ITK's own use file sets directory-wide flags, so its variables are used.
find_package(ITK 5 REQUIRED COMPONENTS ITKCommon ITKIOImageBase ITKIONRRD ITKIONIFTI ITKSmoothing ITKConnectedComponents)
add_library(palpate_itk INTERFACE)
target_include_directories(palpate_itk SYSTEM INTERFACE ${ITK_INCLUDE_DIRS})
target_link_libraries(palpate_itk INTERFACE ${ITK_LIBRARIES})

# Decoding compressed DICOM pixels. Its own configuration drags in what is not needed.
find_path(GDCM_INCLUDE gdcmBitmap.h PATH_SUFFIXES gdcm-3.0 REQUIRED)
add_library(palpate_gdcm INTERFACE)
target_include_directories(palpate_gdcm SYSTEM INTERFACE ${GDCM_INCLUDE})
foreach(library gdcmMSFF gdcmDSED gdcmCommon)
  find_library(${library}_LIBRARY ${library} REQUIRED)
  target_link_libraries(palpate_gdcm INTERFACE ${${library}_LIBRARY})
endforeach()

find_package(ZLIB REQUIRED)
add_library(palpate_zlib INTERFACE)
target_link_libraries(palpate_zlib INTERFACE ZLIB::ZLIB)

find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(CLI11 REQUIRED)
add_library(palpate_text INTERFACE)
target_link_libraries(palpate_text INTERFACE fmt::fmt nlohmann_json::nlohmann_json tomlplusplus::tomlplusplus CLI11::CLI11 Threads::Threads)

find_package(HDF5 REQUIRED COMPONENTS C)
add_library(palpate_hdf5 INTERFACE)
target_include_directories(palpate_hdf5 SYSTEM INTERFACE ${HDF5_C_INCLUDE_DIRS})
target_link_libraries(palpate_hdf5 INTERFACE ${HDF5_C_LIBRARIES})

find_package(OpenSSL REQUIRED COMPONENTS Crypto)
add_library(palpate_hash INTERFACE)
target_link_libraries(palpate_hash INTERFACE OpenSSL::Crypto)

find_package(PNG REQUIRED)
add_library(palpate_png INTERFACE)
target_link_libraries(palpate_png INTERFACE PNG::PNG)

# Its hidraw side alone: the libusb side takes devices away from the kernel and drops the wrong reports.
find_path(HIDAPI_INCLUDE hidapi/hidapi.h REQUIRED)
find_library(HIDAPI_LIBRARY hidapi-hidraw REQUIRED)
add_library(palpate_hidapi INTERFACE)
target_include_directories(palpate_hidapi SYSTEM INTERFACE ${HIDAPI_INCLUDE})
target_link_libraries(palpate_hidapi INTERFACE ${HIDAPI_LIBRARY})

if(PALPATE_WITH_CGAL)
  find_package(CGAL REQUIRED)
  add_library(palpate_cgal INTERFACE)
  target_link_libraries(palpate_cgal INTERFACE CGAL::CGAL)
endif()
