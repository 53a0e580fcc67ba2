"""Stands in for the USB of pyspacemouse: one SpaceMouse, whose reports arrive on the socket $SPACEMOUSE."""

import os
import socket


class HIDException(Exception):
    pass


class Device:
    vendor_id, product_id, path = 0x256F, 0xC633, "usb"
    product_string = manufacturer_string = serial_number = ""
    release_number = 0

    def open(self):
        self.reports = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.reports.bind(os.environ["SPACEMOUSE"])

    def close(self):
        self.reports.close()

    def set_nonblocking(self, nonblocking):
        self.reports.setblocking(not nonblocking)

    def read(self, size):
        return bytearray(self.reports.recv(size))


class Enumeration:
    def find(self, **_):
        return [Device()]
