"""World coordinates by astropy (wcslib) of headers in every form satphot reads: tests/data/wcs_vectors.txt.

python3 scripts/make_wcs_vectors.py > tests/data/wcs_vectors.txt
"""
import warnings

import astropy
from astropy.io.fits import Header
from astropy.wcs import WCS

warnings.simplefilter("ignore")
PLACE = dict(NAXIS=2, NAXIS1=1000, NAXIS2=800, CTYPE1="RA---TAN", CTYPE2="DEC--TAN", CRVAL1=150.0, CRVAL2=-35.0,
             CRPIX1=500.5, CRPIX2=400.5)
CD = dict(CD1_1=-2e-4, CD1_2=3e-5, CD2_1=3e-5, CD2_2=2e-4)
PV = dict(PV1_0=1e-4, PV1_1=1.0005, PV1_2=2e-4, PV1_4=1e-3, PV1_5=-5e-4, PV1_6=7e-4, PV1_7=0.02, PV1_8=-0.01, PV1_9=0.015,
          PV1_10=0.005, PV2_0=-2e-4, PV2_1=0.9996, PV2_2=-1e-4, PV2_4=-8e-4, PV2_5=4e-4, PV2_6=6e-4, PV2_7=0.018,
          PV2_8=0.003, PV2_9=-0.012, PV2_10=0.009)
HIGH = dict(PV1_3=3e-4, PV2_11=0.01, PV1_12=0.3, PV1_16=-0.2, PV1_17=1.0, PV1_22=0.7, PV1_23=0.5, PV1_24=3.0, PV1_30=-2.0,
            PV1_31=11.0, PV1_38=9.0, PV1_39=5.0, PV2_13=0.4, PV2_15=0.3, PV2_19=2.0, PV2_27=6.0, PV2_35=20.0)
TPV = dict(CTYPE1="RA---TPV", CTYPE2="DEC--TPV")
SIP = dict(CTYPE1="RA---TAN-SIP", CTYPE2="DEC--TAN-SIP", A_ORDER=3, B_ORDER=3, A_2_0=3e-7, A_1_1=-1.2e-6, A_0_2=5.5e-7,
           A_3_0=2e-10, A_1_2=-3e-10, B_2_0=7e-8, B_1_1=-8e-7, B_0_2=-9e-7, B_0_3=4e-10, B_2_1=1e-10)
SWAP = dict(CTYPE1="DEC--TAN", CTYPE2="RA---TAN", CRVAL1=-35.0, CRVAL2=150.0)
CASES = {
    "CD": dict(PLACE, **CD),
    "CD beside CDELT and CROTA, which do not count": dict(PLACE, CDELT1=-1.0, CDELT2=1.0, CROTA1=45.0, CROTA2=45.0, **CD),
    "PC and CDELT": dict(PLACE, CDELT1=-2e-4, CDELT2=2.1e-4, PC1_1=0.8, PC1_2=-0.6, PC2_1=0.55, PC2_2=0.83),
    "PC alone": dict(PLACE, PC1_1=-2e-4, PC1_2=1e-5, PC2_1=1e-5, PC2_2=2e-4),
    "PC with absent terms": dict(PLACE, CDELT1=-2e-4, CDELT2=2e-4, PC1_2=0.1),
    "CDELT alone": dict(PLACE, CDELT1=-2e-4, CDELT2=2e-4),
    "CDELT and CROTA2": dict(PLACE, CDELT1=-2e-4, CDELT2=2.2e-4, CROTA2=33.0),
    "swapped axes, CD": dict(PLACE, **SWAP, CD1_1=3e-5, CD1_2=2e-4, CD2_1=-2e-4, CD2_2=3e-5),
    "swapped axes, CROTA1": dict(PLACE, **SWAP, CDELT1=2.2e-4, CDELT2=-2e-4, CROTA1=33.0),
    "LONPOLE 90": dict(PLACE, LONPOLE=90.0, **CD),
    "LONPOLE 170 and LATPOLE 20": dict(PLACE, LONPOLE=170.0, LATPOLE=20.0, **CD),
    "LONPOLE as PV1_3": dict(PLACE, PV1_3=170.0, **CD),
    "near the pole": dict(PLACE, **CD, **{}) | dict(CRVAL1=251.337418297, CRVAL2=89.97),
    "across 0 h": dict(PLACE, **CD) | dict(CRVAL1=359.99, CRVAL2=2.0),
    "reference pixel far outside": dict(PLACE, **CD) | dict(CRPIX1=-1098.2, CRPIX2=11365.8),
    "TAN-SIP": dict(PLACE, **CD) | SIP,
    "TAN-SIP with LONPOLE": dict(PLACE, LONPOLE=90.0, **CD) | SIP,
    "TPV": dict(PLACE, **CD, **PV) | TPV,
    "TPV by the name of TAN (SCAMP)": dict(PLACE, **CD, **PV),
    "TPV with terms of r and high degree": dict(PLACE, **CD, **(PV | HIGH)) | TPV,
    "TPV with LONPOLE": dict(PLACE, LONPOLE=120.0, **CD, **PV) | TPV,
}
POINTS = [(0, 0), (999, 0), (0, 799), (999, 799), (499.5, 399.5), (123.25, 700.5)]

print(f"# astropy {astropy.__version__}, all_pix2world, 0-based pixels; scripts/make_wcs_vectors.py")
for name, cards in CASES.items():
    header = Header()
    for key, value in cards.items():
        header[key] = value
    wcs = WCS(header)
    lon = 1 if cards["CTYPE1"].startswith("DEC") else 0
    print(f"case {name}")
    for key, value in cards.items():
        print(f"{key} = {value!r}")
    for x, y in POINTS:
        world = wcs.all_pix2world([[x, y]], 0)[0]
        print(f"at {x} {y} {world[lon]:.12f} {world[1 - lon]:.12f}")
