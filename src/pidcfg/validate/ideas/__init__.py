"""What the rules of several vendors look for: each check once, over the little that it needs of a vendor's loops.

A vendor's rule says what only that vendor can say: code, severity, basis, message and documentation. Its body hands its
loop to one of these. None of them knows a vendor.
"""
